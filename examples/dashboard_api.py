"""Reads a running session and sets a marker in it, over HTTP.

    teampulse demo &
    python3 examples/dashboard_api.py http://127.0.0.1:8742

A dashboard with `tokens` needs one for `mark` or `control` after the address.
"""

import json
import sys
import urllib.parse
import urllib.request

ADDRESS = sys.argv[1].rstrip("/") if len(sys.argv) > 1 else "http://127.0.0.1:8742"
HEADERS = {"Authorization": f"Bearer {sys.argv[2]}"} if len(sys.argv) > 2 else {}


def get(path: str, **question) -> dict | list:
    """What `/api` answers."""
    query = urllib.parse.urlencode(question)
    request = urllib.request.Request(f"{ADDRESS}/api/{path}?{query}", headers=HEADERS)
    with urllib.request.urlopen(request) as answer:
        return json.load(answer)


def post(**event) -> dict:
    """Reports something that happened, now unless `at` (seconds of the session) or `unix` (seconds) is given."""
    body = json.dumps(event).encode()
    headers = {"Content-Type": "application/json", **HEADERS}
    request = urllib.request.Request(f"{ADDRESS}/api/events", body, headers)
    with urllib.request.urlopen(request) as answer:
        return json.load(answer)


for stream in get("streams"):
    if stream["signal"] == "battery" and not stream["derived"]:
        latest = get("latest", stream=stream["name"])[stream["name"]]
        values = latest.get("values", {})
        shown = (f"{name} {each['value']} {each['unit']}" for name, each in values.items())
        print(stream["name"], latest.get("health", {}).get("state"), ", ".join(shown))
        past = get("history", stream=stream["name"], **{"from": -60}, points=60)
        known = [mean for mean in past["channels"][0]["mean"] if mean is not None]
        print(f"  {past['channels'][0]['name']}: {len(known)} columns of {past['step']} s in the last minute")

print("marked at", post(label="from Python")["t"], "s")
