// An independent ROS 2 peer over Debian's Fast DDS: the same two commands, options and output as
// `cyclone_peer.py publish` and `subscribe`.

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>

#include "handed_over.hpp"
#include "payload.hpp"
#include "version.hpp"

using namespace eprosima::fastdds::dds;
using Message = std_msgs::msg::dds_::UInt8MultiArray_;

/// How long a best-effort message may be under way: nobody acknowledges it.
constexpr double in_flight_secs = 0.5;

/// `--name value` and `--flag`, as they stand on the command line.
class Options {
 public:
  Options(int count, char **words) {
    for (int i = 0; i < count; ++i) {
      std::string name = words[i];
      bool has_value = i + 1 < count && std::string(words[i + 1]).rfind("--", 0) != 0;
      values_[name] = has_value ? words[++i] : "";
    }
  }
  bool has(const std::string &name) const { return values_.count(name) > 0; }
  double number(const std::string &name, double otherwise) const {
    return has(name) ? std::stod(values_.at(name)) : otherwise;
  }

 private:
  std::map<std::string, std::string> values_;
};

/// Whether whoever started this program still holds its standard input open.
bool leashed() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  char byte;
  return poll(&input, 1, 0) == 0 || read(STDIN_FILENO, &byte, 1) > 0;
}

void sleep_secs(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

double cpu_secs() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

DomainParticipant *join(const Options &options) {
  DomainParticipantQos qos = PARTICIPANT_QOS_DEFAULT;
  // The kernel's default holds a fifth of a 1 MiB message. The send buffer stays as it is: readers
  // are asked to acknowledge each time so many bytes were sent.
  qos.transport().listen_socket_buffer_size = 4 << 20;
  auto domain = static_cast<DomainId_t>(options.number("--domain", 0));
  return DomainParticipantFactory::get_instance()->create_participant(domain, qos);
}

std::vector<Topic *> topics(DomainParticipant *participant, const std::string &name, int count) {
  TypeSupport type(new version::NamedType());
  type.register_type(participant);
  std::vector<Topic *> topics;
  for (int k = 0; k < count; ++k) {
    auto full_name = "rt" + name + (count == 1 ? "" : std::to_string(k));
    topics.push_back(participant->create_topic(full_name, type.get_type_name(), TOPIC_QOS_DEFAULT));
  }
  return topics;
}

/// What writers and readers are asked for in the same words.
template <typename EndpointQos>
EndpointQos endpoint_qos(EndpointQos qos, const Options &options) {
  int depth = static_cast<int>(options.number("--depth", 1000));
  qos.reliability().kind =
      options.has("--best-effort") ? BEST_EFFORT_RELIABILITY_QOS : RELIABLE_RELIABILITY_QOS;
  qos.durability().kind =
      options.has("--transient-local") ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
  qos.history().kind = KEEP_LAST_HISTORY_QOS;
  qos.history().depth = depth;
  qos.resource_limits().max_instances = 1;
  qos.resource_limits().max_samples = depth;
  qos.resource_limits().max_samples_per_instance = depth;
  qos.endpoint().history_memory_policy = version::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  return qos;
}

DataWriterQos writer_qos(const Options &options) {
  auto qos = endpoint_qos(DATAWRITER_QOS_DEFAULT, options);
  // An asynchronous writer, rmw_fastrtps's default before Galactic, overwrites what it has not sent
  // yet; a synchronous one, its default since, sends within `write`.
  bool synchronous = options.has("--synchronous");
  qos.publish_mode().kind = synchronous ? SYNCHRONOUS_PUBLISH_MODE : ASYNCHRONOUS_PUBLISH_MODE;
  // The type's hash as rclcpp puts it into USER_DATA.
  std::string hash =
      "typehash=RIHS01_5687e861b8d307a5e48b7515467ae7a5fc2daf805bd0ce6d8e9e604bade9f385;";
  qos.user_data().setValue({hash.begin(), hash.end()});
  return qos;
}

bool matched(DataWriter *writer, int subscribers) {
  PublicationMatchedStatus status;
  writer->get_publication_matched_status(status);
  return status.current_count >= subscribers;
}

int publish(const std::string &topic, const Options &options) {
  auto *participant = join(options);
  auto *publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
  auto subscribers = static_cast<int>(options.number("--subscribers", 1));
  auto burst = static_cast<std::uint64_t>(options.number("--burst", 1));
  auto count = static_cast<std::uint64_t>(options.number("--count", 1));
  double rate_hz = options.number("--rate", 100);

  std::vector<DataWriter *> writers;
  for (auto *each : topics(participant, topic, static_cast<int>(options.number("--topics", 1))))
    writers.push_back(publisher->create_datawriter(each, writer_qos(options)));
  for (auto *writer : writers)
    while (!matched(writer, subscribers)) {
      if (!leashed()) return 1;
      sleep_secs(0.01);
    }
  std::printf("{\"matched\": %zu}\n", writers.size());
  std::fflush(stdout);
  // A writer sees its reader before the reader sees it, and DDS offers no way to ask.
  sleep_secs(options.number("--settle-secs", 2));

  Message message;
  message.data().resize(static_cast<std::size_t>(options.number("--size", 64)));
  std::printf("{\"begun\": %zu}\n", writers.size());
  std::fflush(stdout);
  auto started_ns = payload::monotonic_ns();
  double cpu_started_secs = cpu_secs();
  for (std::uint64_t number = 0; number < count; ++number) {
    double due_secs = static_cast<double>(number / burst * burst) / rate_hz;
    double pause_secs = due_secs - (payload::monotonic_ns() - started_ns) / 1e9;
    if (pause_secs > 0) sleep_secs(pause_secs);
    payload::fill(message.data(), number);
    for (auto *writer : writers)
      if (!version::written(writer->write(&message))) return 1;
  }
  double seconds = (payload::monotonic_ns() - started_ns) / 1e9;
  double cpu_used_secs = cpu_secs() - cpu_started_secs;
  bool acknowledged = true;
  if (options.has("--best-effort")) sleep_secs(in_flight_secs);
  else
    for (auto *writer : writers)
      acknowledged &= writer->wait_for_acknowledgments({10, 0}) == version::ok;
  std::printf("{\"sent\": %lu, \"topics\": %zu, \"seconds\": %.3f, ",
              static_cast<unsigned long>(count), writers.size(), seconds);
  auto &handed = handed_over::counter();
  std::printf("\"cpu_secs\": %.3f, \"handed_over\": %lu, \"sent_again\": %lu, ", cpu_used_secs,
              static_cast<unsigned long>(handed.first()), static_cast<unsigned long>(handed.again()));
  std::printf("\"acknowledged\": %s}\n", acknowledged ? "true" : "false");
  std::fflush(stdout);
  while (leashed()) sleep_secs(0.05);
  return 0;
}

/// Counts what arrives on one topic.
class Tally : public DataReaderListener {
 public:
  void on_data_available(DataReader *reader) override {
    Message message;
    SampleInfo info;
    while (reader->take_next_sample(&message, &info) == version::ok) {
      if (!info.valid_data) continue;
      auto number = payload::read(message.data());
      std::lock_guard lock(mutex_);
      if (number) numbers_.push_back(*number);
      else ++corrupt_;
    }
  }
  std::size_t messages() {
    std::lock_guard lock(mutex_);
    return numbers_.size() + corrupt_;
  }
  void print() {
    std::lock_guard lock(mutex_);
    std::set<std::uint64_t> seen(numbers_.begin(), numbers_.end());
    std::size_t span = seen.empty() ? 0 : *seen.rbegin() - *seen.begin() + 1;
    std::size_t swapped = 0;
    for (std::size_t i = 1; i < numbers_.size(); ++i) swapped += numbers_[i] < numbers_[i - 1];
    std::printf("{\"received\": %zu, \"corrupt\": %zu, \"missing\": %zu, ", numbers_.size(),
                corrupt_, span - seen.size());
    std::printf("\"duplicates\": %zu, \"out_of_order\": %zu}", numbers_.size() - seen.size(),
                swapped);
  }

 private:
  std::mutex mutex_;
  std::vector<std::uint64_t> numbers_;
  std::size_t corrupt_ = 0;
};

int subscribe(const std::string &topic, const Options &options) {
  auto *participant = join(options);
  auto *subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  std::vector<std::unique_ptr<Tally>> tallies;
  for (auto *each : topics(participant, topic, static_cast<int>(options.number("--topics", 1)))) {
    tallies.push_back(std::make_unique<Tally>());
    auto qos = endpoint_qos(DATAREADER_QOS_DEFAULT, options);
    subscriber->create_datareader(each, qos, tallies.back().get());
  }
  std::printf("{\"subscribed\": %zu}\n", tallies.size());
  std::fflush(stdout);

  auto wanted = options.number("--count", 1e18) * static_cast<double>(tallies.size());
  auto deadline_ns = payload::monotonic_ns() + 1e9 * options.number("--seconds", 60);
  std::size_t messages = 0;
  while (messages < wanted && payload::monotonic_ns() < deadline_ns && leashed()) {
    sleep_secs(0.02);
    messages = 0;
    for (auto &tally : tallies) messages += tally->messages();
  }
  std::printf("{\"messages\": %zu, \"topics\": [", messages);
  for (auto &tally : tallies) {
    if (tally != tallies.front()) std::printf(", ");
    tally->print();
  }
  std::puts("]}");
  std::fflush(stdout);
  return 0;
}

int main(int count, char **words) {
  std::string command = count > 2 ? words[1] : "";
  Options options(count - 3, words + 3);
  int code = 2;
  if (command == "publish") code = publish(words[2], options);
  if (command == "subscribe") code = subscribe(words[2], options);
  if (code == 2) std::fprintf(stderr, "usage: fastdds_peer publish|subscribe TOPIC [--OPTION]\n");
  _exit(code);  // Taking the participant apart takes seconds, and tests nothing of ours.
}
