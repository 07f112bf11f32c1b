#!/usr/bin/env python3
"""A worker of your own: how far skin conductance rises within each batch of samples [uS]."""

import json
import sys

OUTPUT = "/humans/persons/p001/own/skin_rise"

for line in sys.stdin:
    readings = []
    for record in json.loads(line):
        first, last = record["samples"][0][0], record["samples"][-1][0]
        readings.append({"stream": OUTPUT, "time_ns": record["time_ns"], "values": [last - first]})
    print(json.dumps(readings), flush=True)
