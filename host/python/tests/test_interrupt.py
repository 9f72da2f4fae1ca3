"""Ctrl-C, progress and other threads."""

import _thread
import signal
import threading
import time

import pytest
import sinew_ident


@pytest.fixture(autouse=True)
def interrupts():
    """Python's own handler: a shell starts background programs with SIGINT ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def interrupt_after(seconds: float) -> threading.Timer:
    timer = threading.Timer(seconds, _thread.interrupt_main)
    timer.start()
    return timer


def test_ctrl_c_ends_a_diagnosis(rig, fit_frame, test_frame, found):
    whole = found.to_dict()["seconds"]
    begin = time.monotonic()
    timer = interrupt_after(0.1 * whole)
    with pytest.raises(KeyboardInterrupt):
        sinew_ident.diagnose(rig, fit_frame, test_frame)
    timer.join()
    assert time.monotonic() - begin < 0.9 * whole


def test_an_error_of_the_progress_callback_ends_a_fit(rig, fit_frame):
    def refuse(what, done, of):
        raise RuntimeError(f"seen: {what}")

    with pytest.raises(RuntimeError, match="seen: stage"):
        sinew_ident.fit(rig, [fit_frame] * 3, progress=refuse)


def test_other_threads_run_and_progress_is_told_in_the_calling_thread(rig, fit_frame):
    told, ticks = [], []
    here = threading.get_ident()
    stop = threading.Event()

    def count():
        while not stop.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.002)

    counter = threading.Thread(target=count)
    counter.start()
    begin = time.monotonic()
    sinew_ident.diagnose(
        rig, fit_frame, progress=lambda *news: told.append((threading.get_ident(), *news))
    )
    end = time.monotonic()
    stop.set()
    counter.join()
    gaps = [b - a for a, b in zip(ticks, ticks[1:]) if begin < b < end]
    assert len(gaps) > 20 and max(gaps) < 0.5 * (end - begin)
    assert told and {thread for thread, *_ in told} == {here}
    assert all(done <= of for _, _, done, of in told)
