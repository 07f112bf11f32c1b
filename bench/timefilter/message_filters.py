"""Measures ROS 1's Python ApproximateTimeSynchronizer: `message_filters.py FILE TOPICS
QUEUE_SIZE SLOP_SECS` prints ns of processor time per message, and the number of sets."""

import sys
import time

# A program in this folder has the same name as the library's module.
sys.path[0] = "/usr/lib/python3/dist-packages"

import message_filters
import rospy
from sensor_msgs.msg import Temperature


def read(path):
    for line in open(path):
        topic, stamp = map(int, line.split())
        message = Temperature()
        message.header.stamp = rospy.Time(*divmod(stamp, 10**9))
        yield topic, message


def main(path, topics, queue_size, slop_secs):
    rospy.rostime.set_rostime_initialized(True)
    arrivals = list(read(path))
    inlets = [message_filters.SimpleFilter() for _ in range(topics)]
    synchronizer = message_filters.ApproximateTimeSynchronizer(inlets, queue_size, slop_secs)
    sets = []
    synchronizer.registerCallback(lambda *messages: sets.append(len(messages)))
    begun = time.process_time()
    for topic, message in arrivals:
        inlets[topic].signalMessage(message)
    print((time.process_time() - begun) / len(arrivals) * 1e9, len(sets))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4]))
