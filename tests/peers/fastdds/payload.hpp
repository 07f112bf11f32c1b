// What the peers put into a message, so that whoever receives it knows what is missing or
// broken. The layout is described in ../payload.py.

#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <optional>
#include <vector>

namespace payload {

constexpr std::size_t crc_at = 16;
constexpr std::size_t head_bytes = 20;

inline std::uint64_t monotonic_ns() {
  auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

/// CRC-32 as zlib has it, continued from `crc`.
inline std::uint32_t crc32(std::uint32_t crc, const std::uint8_t *bytes, std::size_t count) {
  static const auto table = [] {
    std::array<std::uint32_t, 256> table{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      table[i] = i;
      for (int bit = 0; bit < 8; ++bit)
        table[i] = table[i] & 1 ? 0xedb88320u ^ (table[i] >> 1) : table[i] >> 1;
    }
    return table;
  }();
  crc = ~crc;
  while (count--)
    crc = table[(crc ^ *bytes++) & 0xff] ^ (crc >> 8);
  return ~crc;
}

inline std::uint32_t checksum(const std::vector<std::uint8_t> &content) {
  auto head = crc32(0, content.data(), crc_at);
  return crc32(head, content.data() + head_bytes, content.size() - head_bytes);
}

/// Writes message `number`; the filler stays as it is.
inline void fill(std::vector<std::uint8_t> &content, std::uint64_t number) {
  auto written_ns = monotonic_ns();
  std::memcpy(content.data(), &number, sizeof number);
  std::memcpy(content.data() + sizeof number, &written_ns, sizeof written_ns);
  auto crc = checksum(content);
  std::memcpy(content.data() + crc_at, &crc, sizeof crc);
}

/// The number of a message; nothing when it is not as it was written.
inline std::optional<std::uint64_t> read(const std::vector<std::uint8_t> &content) {
  if (content.size() < head_bytes)
    return {};
  std::uint32_t crc;
  std::memcpy(&crc, content.data() + crc_at, sizeof crc);
  std::uint64_t number;
  std::memcpy(&number, content.data(), sizeof number);
  return crc == checksum(content) ? std::optional(number) : std::nullopt;
}

}  // namespace payload
