#!/usr/bin/env python3
"""Decodes every message of a bag with PyPI's `rosbags` and with `mcap-ros2-support`.

`read_bag.py BAG` prints one line of counts by type, and fails when a message does not decode or the
two don't agree.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import bags


def main() -> None:
    bag = Path(sys.argv[1])
    by_rosbags, by_mcap = bags.decoded_by_rosbags(bag), bags.decoded_by_mcap(bag)
    if by_rosbags != by_mcap:
        sys.exit(f"rosbags decoded {by_rosbags}, mcap-ros2-support {by_mcap}")
    print(by_rosbags.total(), *(f"{name}={count}" for name, count in sorted(by_rosbags.items())))


if __name__ == "__main__":
    main()
