#!/usr/bin/env python3
"""Measures how long calls go on after Ctrl-C.

usage: interrupts.py [--times N] [CALL …]    calls of test_calls.py, all by default
"""

import argparse
import random
import signal
import subprocess
import sys
import time

from test_calls import INTERRUPTED, LONG_CALLS


def latency(name: str, wait: float) -> float:
    setup, call = LONG_CALLS[name]
    program = INTERRUPTED.format(setup=setup, call=call)
    child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    child.stdout.readline()
    time.sleep(wait)
    sent = time.monotonic()
    child.send_signal(signal.SIGINT)
    rest, _ = child.communicate()
    if child.returncode != 7:
        raise SystemExit(f"{name}: exit {child.returncode}")
    return float(rest) - sent


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("calls", nargs="*", default=list(LONG_CALLS))
    arguments = parser.parse_args()
    chance = random.Random(1)
    for name in arguments.calls:
        taken = sorted(latency(name, chance.uniform(0.05, 2)) for _ in range(arguments.times))
        print(f"{name:12} median {taken[len(taken) // 2]:.3f} s, longest {taken[-1]:.3f} s", flush=True)


if __name__ == "__main__":
    main()
