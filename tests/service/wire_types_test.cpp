// Version 1 of the wire is frozen: what other programs were compiled against must not change under them.
#include <gtest/gtest.h>
#include <xxhash.h>

#include <cinttypes>
#include <fstream>
#include <sstream>
#include <vector>

#include "idl/wire/topic.hpp"

namespace {

using namespace slew::wire;

// Type information and type mapping are XTypes' own complete and minimal description of a type: member names,
// order, bounds, keys, extensibility.
template <typename T>
std::string line() {
  const dds_topic_descriptor_t& type = *Topic<T>::descriptor();
  XXH3_state_t* state = XXH3_createState();
  XXH3_128bits_reset(state);
  XXH3_128bits_update(state, type.type_information.data, type.type_information.sz);
  XXH3_128bits_update(state, type.type_mapping.data, type.type_mapping.sz);
  const XXH128_hash_t hash = XXH3_128bits_digest(state);
  XXH3_freeState(state);
  char text[256];
  std::snprintf(text, sizeof text, "%-16s %-24s keys %u  %016" PRIx64 "%016" PRIx64 "\n", Topic<T>::name,
                type.m_typename, type.m_nkeys, hash.high64, hash.low64);
  return text;
}

std::string dump() {
  return line<slew_v1_Request>() + line<slew_v1_Control>() + line<slew_v1_Query>() + line<slew_v1_Reply>() +
         line<slew_v1_Answer>() + line<slew_v1_Experiment>() + line<slew_v1_Channels>() +
         line<slew_v1_State>() + line<slew_v1_Thrusters>() + line<slew_v1_Event>() + line<slew_v1_Server>();
}

TEST(WireTypes, AreThoseThatWereFrozen) {
  std::ifstream file(SLEW_SOURCE_DIR "/idl/v1.types");
  std::stringstream frozen;
  frozen << file.rdbuf();
  EXPECT_EQ(dump(), frozen.str()) << "a type of version 1 has changed: make a version 2 beside it instead";
}

TEST(WireTypes, KeysAreSixteenOctets) {
  for (const auto* type : {&slew_v1_Request_desc, &slew_v1_State_desc, &slew_v1_Server_desc}) {
    EXPECT_EQ(type->m_nkeys, 1u) << type->m_typename;
    // Otherwise instance handles would be hashed, and differ between vendors.
    EXPECT_TRUE(type->m_flagset & DDS_TOPIC_FIXED_KEY) << type->m_typename;
  }
}

}  // namespace
