// Ownership of a DDS entity: deleted with its children when the owner goes.
#pragma once

#include <dds/dds.h>

#include <utility>

namespace slew::wire {

class Entity {
 public:
  Entity() = default;
  explicit Entity(dds_entity_t handle) : handle_(handle) {}
  Entity(Entity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  Entity& operator=(Entity&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  Entity(const Entity&) = delete;
  Entity& operator=(const Entity&) = delete;
  ~Entity() {
    if (handle_ > 0) dds_delete(handle_);
  }

  dds_entity_t get() const { return handle_; }

 private:
  dds_entity_t handle_ = 0;
};

}  // namespace slew::wire
