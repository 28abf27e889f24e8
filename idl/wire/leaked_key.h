/* Cyclone DDS 0.10 never lets go of the key of a transient-local instance: its writer history counts one
   reference more than it gives back when the instance is unregistered, some 300 bytes for every request and
   every experiment that ever was. Later versions give it back. */
#pragma once

#include <dds/dds.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Gives back the reference that stayed behind. To be called once after each unregistering of an instance that a
   transient-local writer has written; with a version that does not leak, it does nothing. `key`: a sample of the
   writer's type. */
void slew_release_leaked_key(dds_entity_t writer, const void* key);

#ifdef __cplusplus
}
#endif
