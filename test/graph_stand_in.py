"""Stands in for nodes/view_program.py in tests of the page: says what a graph would, and answers requests.

``python graph_stand_in.py NAMESPACE``: below ``/silent`` nothing is heard, below ``/none`` ROS is missing.
"""

from __future__ import annotations

import json
import math
import sys
import threading
import time

CABLES = ("cable_1", "cable_2", "cable_3")
HINGES = ([0.0, 0.0, -2.0], [2.0, 0.0, -2.0], [1.0, 3.0, -2.0])
_LOCK = threading.Lock()


def say(kind: str, **content: object) -> None:
    with _LOCK:
        print(json.dumps({"kind": kind, **content}), flush=True)


def answered() -> None:
    for line in sys.stdin:
        asked = json.loads(line)
        if asked["do"] == "start":
            name = asked["name"] or "run_1"
            taken = name == "taken"
            told = (
                f"recording {name}: is there already"
                if taken
                else f"window {name} ({asked['window']}) is open"
            )
            say("answer", id=asked["id"], success=not taken, message=told)
            say("window", window=told)
        else:
            say("answer", id=asked["id"], success=True, message="window run_1: 123 messages on 5 topics")
            say("window", window="1 windows")
    sys.exit(0)


def rig(time_s: float) -> list[dict[str, object]]:
    aside = 0.2 * math.sin(time_s)
    hinges = [[x + aside, y, z] for x, y, z in HINGES]
    ceiling = [[x, y, 0.0] for x, y, _ in HINGES]
    cables = [p for pair in zip(ceiling, hinges, strict=True) for p in pair]
    body = [p for i, j in ((0, 1), (1, 2), (2, 0)) for p in (hinges[i], hinges[j])]
    return [
        {"name": "cables", "lines": True, "points": cables, "colours": [[0, 200, 0]] * 6},
        {"name": "body", "lines": True, "points": body, "colours": []},
        {"name": "ceiling", "lines": False, "points": ceiling, "colours": []},
    ]


def look() -> dict[str, object]:
    """What the program says that watches."""
    std = 8.0
    return {
        "recording": "run_1",
        "seconds": 6.0,
        "faults": ["<b>cable_3</b> is wired the wrong way round. Swap its leads."],
        "verdict": "explained",
        "text": "The load cell of cable_2 has a scale error of 0.0149: it reads that share too high.",
        "error": 1.8,
        "cause": "load_cell_gain cable_2",
        "took": 4.0,
        "body": {
            "mass": {"value": 990.0, "std": 0.2},
            "center_of_mass": {"value": [0.69, 1.08, -1.07], "std": [0.001, 0.001, 0.01]},
            "inertia": {
                "value": [[1108.0, -1.0, 30.0], [-1.0, 338.0, 18.0], [30.0, 18.0, 1296.0]],
                "std": [[std, 3.0, 4.0], [3.0, std, 5.0], [4.0, 5.0, std]],
            },
        },
        "forecast": {
            "seconds": [6.0, 18.0, 60.0],
            "share": [0.04, 0.02, 0.008],
            "aim": 0.01,
            "enough": 47.0,
            "force": "planned",
        },
    }


def main(namespace: str) -> None:
    if namespace == "/none":
        say("missing", message="No module named 'rclpy'")
        return
    threading.Thread(target=answered, daemon=True).start()
    print("a line of some library", flush=True)
    say(
        "graph",
        identifier=namespace == "/rig",
        cells=list(CABLES) if namespace == "/rig" else [],
        namespace=namespace,
    )
    begun = time.monotonic()
    while namespace == "/silent":
        time.sleep(1.0)
    say("window", window="0 windows")
    say("diagnostic", name="imu: source", level=1, message="no samples for 2 s")
    say("watch", watch=look())
    count = 0
    while True:
        now = time.monotonic() - begun
        pulls = [3000.0 + 200.0 * math.sin(now), 2500.0, 88.125]
        say("tension", tension=dict(zip(CABLES, pulls, strict=True)))
        say("rig", shapes=rig(now))
        if count % 5 == 0:
            values = [990.0, 0.69, 1.08, -1.07, 1108.0, -1.0, 30.0, 338.0, 18.0, 1296.0]
            std = [
                v * 0.1 / (1.0 + now) for v in (1.0, 0.1, 0.1, 0.1, 600.0, 300.0, 300.0, 300.0, 300.0, 600.0)
            ]
            say("running", time=1000.0 + now, values=values, std=std)
        count += 1
        time.sleep(0.08)


if __name__ == "__main__":
    main(sys.argv[1])
