"""Signals of interruption: heard once, in the main thread alone; and what is kept of a large matrix."""

import signal
import threading

import pytest

from citypv.core.settings.progress import CancelledError, Interruption, silent


def test_an_interruption_is_heard_once_and_the_old_handlers_come_back():
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    told = []
    with Interruption(lambda *report: told.append(report)) as heard:
        heard("sky and reflections", 1, 2, "rays")
        with pytest.raises(KeyboardInterrupt):
            heard.handle(signal.SIGINT, None)
        heard("suns", 1, 2, "rays")
        signal.raise_signal(signal.SIGINT)
        assert heard.asked
        with pytest.raises(CancelledError):
            heard("suns", 2, 2, "rays")
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
    assert len(told) == 2
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before


def test_in_another_thread_nothing_is_heard():
    failed = []

    def work():
        try:
            with Interruption(silent) as heard:
                heard("suns", 1, 2, "rays")
        except Exception as error:  # a thread would swallow it
            failed.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert not failed
