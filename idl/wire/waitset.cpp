#include "idl/wire/waitset.hpp"

#include <string>

namespace slew::wire {
namespace {

Entity checked(dds_entity_t entity, const char* what) {
  if (entity < 0) throw WireError(std::string(what) + ": " + dds_strretcode(entity));
  return Entity(entity);
}

}  // namespace

Waitset::Waitset(const Domain& domain)
    : waitset_(checked(dds_create_waitset(domain.participant()), "no waitset")),
      guard_(checked(dds_create_guardcondition(domain.participant()), "no guard condition")) {
  dds_waitset_attach(waitset_.get(), guard_.get(), 0);
}

void Waitset::attach(dds_entity_t reader) {
  // The condition is a child of the reader and goes with it.
  const dds_entity_t condition = dds_create_readcondition(reader, DDS_ANY_STATE);
  if (condition < 0 || dds_waitset_attach(waitset_.get(), condition, condition) != DDS_RETCODE_OK)
    throw WireError("a reader could not be waited for");
}

void Waitset::wake() {
  dds_set_guardcondition(guard_.get(), true);
}

bool Waitset::wait(std::chrono::nanoseconds timeout) {
  const dds_return_t triggered = dds_waitset_wait(waitset_.get(), nullptr, 0, timeout.count());
  bool was_set = false;
  dds_take_guardcondition(guard_.get(), &was_set);
  return triggered > 0 || was_set;
}

}  // namespace slew::wire
