#!/usr/bin/env python3
"""A worker of one's own: how far the skin rises within each notification [uS]."""

import json
import sys

OUTPUT = "/humans/persons/p001/own/skin_rise"

for line in sys.stdin:
    readings = []
    for record in json.loads(line):
        first, last = record["samples"][0][0], record["samples"][-1][0]
        readings.append({"stream": OUTPUT, "time_ns": record["time_ns"], "values": [last - first]})
    print(json.dumps(readings), flush=True)
