// Measures how many messages per CPU-second the bag writer of ROS 1 takes: `rosbag_writer FILE MESSAGES BYTES`.
// The counterpart of src/main.rs: eight topics in turn, uncompressed, the same payloads.

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>
#include <vector>

#include <rosbag/bag.h>
#include <std_msgs/UInt8MultiArray.h>

constexpr int TOPICS = 8;
constexpr int PAYLOADS = 64;

// Makes doubles of a slow wave with noise, like those of sensors.
static std_msgs::UInt8MultiArray message(int k, size_t bytes) {
  std::vector<double> wave((bytes + 7) / 8);
  uint64_t state = k + 1;
  for (size_t n = 0; n < wave.size(); ++n) {
    state = state * 6364136223846793005u + 1;
    const double noise = (state >> 40) / double(1 << 24);
    wave[n] = std::sin(n * 0.01) + 0.01 * noise;
  }
  std_msgs::UInt8MultiArray message;
  message.data.resize(bytes);
  std::memcpy(message.data.data(), wave.data(), bytes);
  return message;
}

int main(int count, char** arguments) {
  if (count != 4) {
    std::fprintf(stderr, "usage: rosbag_writer FILE MESSAGES BYTES\n");
    return 2;
  }
  const long messages = std::atol(arguments[2]);
  const size_t bytes = std::atol(arguments[3]);
  ros::Time::init();
  std::vector<std_msgs::UInt8MultiArray> payloads;
  for (int k = 0; k < PAYLOADS; ++k) payloads.push_back(message(k, bytes));
  std::vector<std::string> topics;
  for (int k = 0; k < TOPICS; ++k) topics.push_back("/robot" + std::to_string(k) + "/data");

  const std::clock_t begun = std::clock();
  rosbag::Bag bag(arguments[1], rosbag::bagmode::Write);
  for (long k = 0; k < messages; ++k) {
    ros::Time stamp;
    stamp.fromNSec(1700000000000000000u + k * 1000000u);
    bag.write(topics[k % TOPICS], stamp, payloads[k % PAYLOADS]);
  }
  bag.close();
  const double cpu_secs = double(std::clock() - begun) / CLOCKS_PER_SEC;
  std::printf("%.0f\n", messages / cpu_secs);
}
