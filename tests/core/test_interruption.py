"""Signals of interruption: heard once, in the main thread alone; and what is kept of a large matrix."""

import signal
import threading

import numpy as np
import pytest

from citypv.core.light import kept_matrix
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


def test_what_is_kept_of_a_large_matrix_comes_into_memory_where_it_has_room(monkeypatch):
    values = np.random.default_rng(0).random((50, 40)).astype(np.float32)
    monkeypatch.setattr(kept_matrix, "LIMIT", 4 * 50 * 20)
    for count, kind in ((30, np.memmap), (20, np.ndarray)):
        matrix = kept_matrix.keep_matrix(values.shape)
        for start in (0, 10, 20, 30):
            matrix[:, start : start + 10] = values[:, start : start + 10]
        kept = kept_matrix.keep_columns(matrix, count)
        assert isinstance(kept, kind)
        assert kept.shape == (50, count)
        np.testing.assert_array_equal(kept[:], values[:, :count])
