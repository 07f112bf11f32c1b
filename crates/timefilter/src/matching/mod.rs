//! Matching messages into sets, as ROS's `message_filters` does.
