// What this process handed to its sockets: Fast DDS may overwrite a message before it is sent, and
// then no reader can be blamed for it.

#pragma once

#include <dlfcn.h>
#include <sys/socket.h>

#include <cstdint>
#include <cstring>
#include <map>
#include <mutex>

namespace handed_over {

/// Counts the messages of our own writers in the packets that are sent.
class Counter {
 public:
  void look_at(const std::uint8_t *packet, std::size_t size) {
    if (size < rtps_header || std::memcmp(packet, "RTPS", 4) != 0) return;
    std::lock_guard lock(mutex_);
    for (std::size_t at = rtps_header; at + 4 <= size;) {
      std::size_t length = packet[at + 1] & 1 ? packet[at + 2] | packet[at + 3] << 8
                                              : packet[at + 2] << 8 | packet[at + 3];
      if ((packet[at] == data || packet[at] == data_frag) && at + 24 <= size) count(packet + at);
      if (length == 0) break;
      at += 4 + length;
    }
  }
  /// How many messages were sent at least once.
  std::uint64_t first() {
    std::lock_guard lock(mutex_);
    return first_;
  }
  /// How many packets were sent of messages that had been sent before.
  std::uint64_t again() {
    std::lock_guard lock(mutex_);
    return again_;
  }

 private:
  static constexpr std::size_t rtps_header = 20;
  static constexpr std::uint8_t data = 0x15, data_frag = 0x16;

  void count(const std::uint8_t *submessage) {
    std::uint32_t writer, high, low;
    std::memcpy(&writer, submessage + 12, 4);
    std::memcpy(&high, submessage + 16, 4);
    std::memcpy(&low, submessage + 20, 4);
    bool of_a_user = (submessage[15] & 0xc0) == 0;
    if (!of_a_user) return;
    auto number = std::uint64_t{high} << 32 | low;
    auto &last = last_[writer];
    if (number > last) ++first_, last = number;
    else ++again_;
  }

  std::mutex mutex_;
  std::map<std::uint32_t, std::uint64_t> last_;
  std::uint64_t first_ = 0, again_ = 0;
};

inline Counter &counter() {
  static Counter counter;
  return counter;
}

template <typename Function>
Function real(const char *name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace handed_over

// Called by Fast DDS in place of the C library's, which they call in turn.

extern "C" ssize_t sendmsg(int socket, const msghdr *message, int flags) {
  static const auto next = handed_over::real<ssize_t (*)(int, const msghdr *, int)>("sendmsg");
  auto sent = next(socket, message, flags);
  if (sent > 0 && message->msg_iovlen == 1) {
    auto *packet = static_cast<const std::uint8_t *>(message->msg_iov[0].iov_base);
    handed_over::counter().look_at(packet, static_cast<std::size_t>(sent));
  }
  return sent;
}

extern "C" ssize_t sendto(int socket, const void *packet, size_t size, int flags,
                          const sockaddr *to, socklen_t to_size) {
  using Sendto = ssize_t (*)(int, const void *, size_t, int, const sockaddr *, socklen_t);
  static const auto next = handed_over::real<Sendto>("sendto");
  auto sent = next(socket, packet, size, flags, to, to_size);
  if (sent > 0)
    handed_over::counter().look_at(static_cast<const std::uint8_t *>(packet),
                                   static_cast<std::size_t>(sent));
  return sent;
}
