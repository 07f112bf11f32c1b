// Measures the sets that ROS 1's C++ message_filters makes, and the processor time it needs:
//   message_filters FILE POLICY TOPICS QUEUE_SIZE AGE_PENALTY MAX_INTERVAL [LOWER_BOUND...]
// FILE has a line "topic stamp" for each message in order of arrival; POLICY is approximate or exact;
// times are in ns; a maximum interval of 0 means no limit; there may be a lower bound for each topic. Prints
// the hash of all sets, their number, and ns per message, the best of three runs.
#include <algorithm>
#include <ctime>
#include <fstream>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include <message_filters/sync_policies/approximate_time.h>
#include <message_filters/sync_policies/exact_time.h>
#include <message_filters/synchronizer.h>
#include <sensor_msgs/Temperature.h>

namespace policies = message_filters::sync_policies;
using Message = sensor_msgs::Temperature;
using Handle = Message::ConstPtr;

struct Arrival {
  int topic;
  Handle message;
};

struct Settings {
  std::string policy;
  int topics;
  uint32_t queue_size;
  double age_penalty;
  long max_interval;
  std::vector<long> lower_bounds;
};

static uint64_t hash;
static size_t sets;

static void digest(const Handle& message) {
  hash = (hash ^ message->header.stamp.toNSec()) * 1099511628211u;
}

template <class... H>
static void on_set(const H&... handles) {
  ++sets;
  (digest(handles), ...);
}

// A callback with as many parameters as there are topics.
template <size_t>
using HandleOf = const Handle&;
template <size_t... I>
static auto callback(std::index_sequence<I...>) {
  return static_cast<void (*)(HandleOf<I>...)>(&on_set<decltype((void)I, Handle())...>);
}

template <class Sync, size_t... I>
static void add(Sync& sync, const Arrival& arrival, std::index_sequence<I...>) {
  ((arrival.topic == static_cast<int>(I) ? sync.template add<I>(arrival.message) : void()), ...);
}

static double cpu_nanos() {
  timespec used;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  return used.tv_sec * 1e9 + used.tv_nsec;
}

static ros::Duration nanos(long count) { return ros::Duration().fromNSec(count); }

template <class M0, class... M>
static void set_up(policies::ApproximateTime<M0, M...>& policy, const Settings& settings) {
  policy.setAgePenalty(settings.age_penalty);
  int topic = 0;
  for (long bound : settings.lower_bounds) policy.setInterMessageLowerBound(topic++, nanos(bound));
  if (settings.max_interval > 0) policy.setMaxIntervalDuration(nanos(settings.max_interval));
}

template <class M0, class... M>
static void set_up(policies::ExactTime<M0, M...>&, const Settings&) {}

template <class Policy, size_t Topics>
static void measure(const std::vector<Arrival>& arrivals, const Settings& settings) {
  std::make_index_sequence<Topics> topics;
  double best = 1e300;
  for (int run = 0; run < 3; ++run) {
    hash = 14695981039346656037u;
    sets = 0;
    Policy policy(settings.queue_size);
    set_up(policy, settings);
    message_filters::Synchronizer<Policy> sync(policy);
    sync.registerCallback(callback(topics));
    const double begun = cpu_nanos();
    for (const Arrival& arrival : arrivals) add(sync, arrival, topics);
    best = std::min(best, cpu_nanos() - begun);
  }
  std::cout << std::hex << hash << std::dec << ' ' << sets << ' ' << best / arrivals.size() << '\n';
}

template <class... M>
static void with_messages(const std::vector<Arrival>& arrivals, const Settings& settings) {
  if (settings.policy == "exact")
    measure<policies::ExactTime<M...>, sizeof...(M)>(arrivals, settings);
  else
    measure<policies::ApproximateTime<M...>, sizeof...(M)>(arrivals, settings);
}

static std::vector<Arrival> read(const char* path) {
  std::vector<Arrival> arrivals;
  std::ifstream file(path);
  uint64_t stamp;
  for (int topic; file >> topic >> stamp;) {
    auto message = boost::make_shared<Message>();
    message->header.stamp.fromNSec(stamp);
    arrivals.push_back({topic, message});
  }
  return arrivals;
}

int main(int count, char** arguments) {
  ros::Time::init();
  const auto arrivals = read(arguments[1]);
  Settings settings{arguments[2], std::stoi(arguments[3]), uint32_t(std::stoul(arguments[4])),
                    std::stod(arguments[5]), std::stol(arguments[6]), {}};
  for (int i = 7; i < count; ++i) settings.lower_bounds.push_back(std::stol(arguments[i]));
  using M = Message;
  switch (settings.topics) {
    case 2: with_messages<M, M>(arrivals, settings); return 0;
    case 3: with_messages<M, M, M>(arrivals, settings); return 0;
    case 5: with_messages<M, M, M, M, M>(arrivals, settings); return 0;
    case 9: with_messages<M, M, M, M, M, M, M, M, M>(arrivals, settings); return 0;
    default: std::cerr << "2, 3, 5 or 9 topics\n"; return 2;
  }
}
