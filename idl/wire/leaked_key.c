/* In C, because these headers of Cyclone DDS are. */
#include "idl/wire/leaked_key.h"

#include <dds/version.h>

#if DDS_VERSION_MAJOR == 0 && DDS_VERSION_MINOR == 10

#include <dds/ddsi/ddsi_domaingv.h>
#include <dds/ddsi/ddsi_entity_index.h>
#include <dds/ddsi/ddsi_endpoint.h> /* needs the one before it */
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_tkmap.h>
#include <dds/ddsi/q_bswap.h>
#include <dds/ddsi/q_thread.h>
#include <string.h>

void slew_release_leaked_key(dds_entity_t writer, const void* key) {
  dds_guid_t bytes;
  if (dds_get_guid(writer, &bytes) != DDS_RETCODE_OK) return;
  ddsi_guid_t guid;
  memcpy(&guid, &bytes, sizeof guid);
  guid = nn_ntoh_guid(guid);
  /* This thread has just unregistered the instance, so the domain that it last worked for is the writer's. */
  struct thread_state* const thread = lookup_thread_state();
  struct ddsi_domaingv* const domain = ddsrt_atomic_ldvoidp(&thread->gv);
  if (domain == NULL) return;
  thread_state_awake(thread, domain);
  const struct ddsi_writer* const found = entidx_lookup_writer_guid(domain->entity_index, &guid);
  if (found != NULL) {
    struct ddsi_serdata* const sample = ddsi_serdata_from_sample(found->type, SDK_KEY, key);
    struct ddsi_tkmap_instance* const instance = ddsi_tkmap_find(domain->m_tkmap, sample, false);
    if (instance != NULL) {
      const uint32_t count = ddsrt_atomic_ld32(&instance->m_refc) & 0x0fffffff; /* the rest are flags */
      if (count > 1) ddsi_tkmap_instance_unref(domain->m_tkmap, instance);
      ddsi_tkmap_instance_unref(domain->m_tkmap, instance); /* the one of this search */
    }
    ddsi_serdata_unref(sample);
  }
  thread_state_asleep(thread);
}

#else

void slew_release_leaked_key(dds_entity_t writer, const void* key) {
  (void)writer;
  (void)key;
}

#endif
