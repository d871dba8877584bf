"""Progress, stopping, options, forks and threads."""

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time

import pytest

import ldi_ops as ldi


def test_progress_functions_hear_of_stages_and_stop_calls():
    heard = []

    class Listener:
        closed = 0

        def __call__(self, stage, done, total):
            heard.append((stage, done, total))

        def close(self):
            Listener.closed += 1

    with ldi.options(progress=Listener()):
        ldi.gyroid(cells=2).offset(0.1).volume(resolution=256)
    assert any(stage for stage, _, _ in heard) and Listener.closed == 2
    with ldi.options(progress=lambda *_: False), pytest.raises(ldi.Cancelled):
        ldi.geodesic().offset(1).volume(resolution=2048)

    def fails(*_):
        raise ZeroDivisionError

    with ldi.options(progress=fails), pytest.raises(ZeroDivisionError):
        ldi.geodesic().offset(1).volume(resolution=2048)


def test_options_hold_within_their_block_and_are_checked():
    with ldi.options(threads=1, memory="2 GB"), ldi.options(threads=2):
        assert float(ldi.geodesic().volume()) > 0
    with ldi.options(memory="40 MB"), pytest.raises(ldi.MachineError, match="memory"):
        ldi.geodesic().sample(resolution=4000)
    for wrong in ({"threads": 0}, {"memory": "much"}, {"memory": -1}):
        with pytest.raises(ldi.UsageError), ldi.options(**wrong):
            pass


@pytest.mark.parametrize("has_tqdm", [True, False])
def test_bars_show_a_stage_and_vanish(capsys, monkeypatch, has_tqdm):
    if not has_tqdm:
        monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    with ldi.options(progress=True):
        ldi.gyroid(cells=2).offset(0.1).volume(resolution=256)
    shown = capsys.readouterr().err
    assert len(shown) > 20 and shown.endswith("\r") and not shown.rsplit("\r", 2)[1].strip()


def test_other_threads_run_meanwhile():
    """The GIL is released: a thread counts while the main thread computes."""
    count, stop = [0], threading.Event()

    def counting():
        while not stop.is_set():
            count[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=counting)
    thread.start()
    before = count[0]
    ldi.gyroid(cells=2).offset(0.2).volume(resolution=256)
    ran = count[0] - before
    stop.set()
    thread.join()
    assert ran > 20


def test_results_do_not_depend_on_the_thread_that_asks():
    ball = ldi.geodesic(frequency=24)
    volumes = []
    threads = [threading.Thread(target=lambda: volumes.append(float(ball.sample(resolution=64).volume()))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(volumes) == 4 and len(set(volumes)) == 1


# A shell starts what runs in its background with SIGINT ignored, and Python then leaves it so. NumPy is imported before the first
# result needs it, because an interrupt within its import ends in its own ImportError.
INTERRUPTED = """
import signal, sys, time
import numpy
import ldi_ops as ldi
signal.signal(signal.SIGINT, signal.default_int_handler)
shape = {setup}
print("ready", flush=True)
try:
    for _ in range(10_000):
        {call}
except KeyboardInterrupt:
    print(time.monotonic())
    sys.exit(7)
"""

LONG_CALLS = {
    "volume": ("ldi.gyroid(cells=3) & ldi.geodesic(radius=14)", "shape.volume()"),
    "estimate": ("ldi.gyroid(cells=3)", "shape.sample(resolution=3000, axes='z')"),
    "offset": ("ldi.gyroid(cells=2)", "shape.offset(0.3).sample(resolution=800)"),
    "mesh": ("ldi.gyroid(cells=3).sample(resolution=400)", "shape.mesh()"),
    "simplify": ("ldi.geodesic().sample(resolution=400)", "shape.mesh(surface_error='0.1h')"),
    "exact-mesh": ("ldi.gyroid(cells=3) & ldi.geodesic(radius=14)", "shape.mesh()"),
    "metrics": ("ldi.gyroid(cells=3)", "shape.metrics(resolution=200)"),
    "thickness": ("ldi.gyroid(cells=3)", "shape.thickness(resolution=300)"),
    "load": ("(lambda g: (g.vertices, g.faces.astype('int64')))(ldi.gyroid(cells=4))", "ldi.load(shape)"),
    "generate": ("None", "ldi.gyroid(cells=6)"),
    "voxels": ("ldi.gyroid(cells=3).sample(resolution=400)", "shape.to_numpy(); shape.coverage()"),
    "clash": ("[ldi.gyroid(cells=2), ldi.bcc(cells=2)]", "ldi.clash({'a': shape[0], 'b': shape[1]})"),
    "picture": ("ldi.gyroid(cells=3)", "shape.picture(1200, 900)"),
}


@pytest.mark.parametrize("name", LONG_CALLS)
def test_interrupts_end_long_calls(name):
    setup, call = LONG_CALLS[name]
    program = INTERRUPTED.format(setup=setup, call=call)
    child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "ready\n"
    time.sleep(0.3)
    child.send_signal(signal.SIGINT)
    rest, _ = child.communicate(timeout=60)
    assert child.returncode == 7 and float(rest) > 0


# Raises where NumPy's version is looked at, as an interrupt may.
AT_THE_FIRST_ARRAY = """
import sys
import numpy
import ldi_ops as ldi
image = ldi.geodesic().sample(resolution=16)
def interrupt(frame, event, argument):
    if frame.f_code.co_filename.endswith("_version.py"):
        raise KeyboardInterrupt
sys.settrace(interrupt)
assert image.to_numpy().any()
"""


def test_no_interrupt_reaches_the_search_for_numpys_functions():
    child = subprocess.run([sys.executable, "-c", AT_THE_FIRST_ARRAY], stderr=subprocess.PIPE, text=True, timeout=60)
    assert child.returncode == 0, child.stderr


def in_child(pipe, image=None):
    try:
        if image is None:
            ldi.geodesic().volume()
        else:
            image.centroid
        pipe.send("no error")
    except ldi.Error as error:
        pipe.send(str(error))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no forks")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_forked_children_are_told_and_spawned_ones_work():
    image = ldi.geodesic().sample(resolution=16)
    for method, arguments, expected in (("fork", (), "spawn"), ("fork", (image,), "spawn"), ("spawn", (), "no error")):
        context = multiprocessing.get_context(method)
        ours, theirs = context.Pipe()
        child = context.Process(target=in_child, args=(theirs, *arguments))
        child.start()
        assert ours.poll(60), f"{method}: the child hangs"
        assert expected in ours.recv()
        child.join()
