// What Fast DDS 2 (Debian 12) and Fast DDS 3 (Debian 13) call differently.

#pragma once

#include <fastdds/dds/topic/TypeSupport.hpp>

#if __has_include("UInt8MultiArrayPubSubTypes.hpp")
#include "UInt8MultiArrayPubSubTypes.hpp"
#define FASTDDS_3
#else
#include "UInt8MultiArrayPubSubTypes.h"
#endif

namespace version {

using Generated = std_msgs::msg::dds_::UInt8MultiArray_PubSubType;

#ifdef FASTDDS_3
using eprosima::fastdds::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
const auto ok = eprosima::fastdds::dds::RETCODE_OK;

/// The type as ROS 2 announces it before Jazzy: by its name alone.
struct NamedType : Generated {
  NamedType() { set_name("std_msgs::msg::dds_::UInt8MultiArray_"); }
  void register_type_object_representation() override {}
};
#else
using eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
const auto ok = eprosima::fastdds::dds::TypeSupport::ReturnCode_t::RETCODE_OK;

/// The type as ROS 2 announces it before Jazzy: by its name alone.
struct NamedType : Generated {
  NamedType() {
    setName("std_msgs::msg::dds_::UInt8MultiArray_");
    auto_fill_type_information(false);
    auto_fill_type_object(false);
  }
};
#endif

/// Whether a `write` was done, in the words of Fast DDS 2, and of Fast DDS 3.
inline bool written(bool done) { return done; }
template <typename Code>
bool written(Code code) { return code == ok; }

}  // namespace version
