"""Matrices of surfaces × suns on disk are the same as those in memory."""

import errno
import os
import pickle

import numpy as np
import pytest
from scenes import suns_towards
from test_tracing import three_houses

from citypv.core.energy.compute_energy import compute_energy
from citypv.core.light import sun_matrix
from citypv.core.light.sun_matrix import is_on_disk, keep_matrix, row_blocks
from citypv.core.light.trace_gather import trace_gather
from citypv.core.results.transfer_file import read_transfer, write_transfer
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request
from citypv.core.weather.read_weather import read_weather

VALUES = np.random.default_rng(3).random((1000, 37), dtype=np.float32)


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(sun_matrix, "LIMIT", 1024)


def on_disk(folder):
    matrix = keep_matrix(VALUES.shape, folder)
    assert is_on_disk(matrix)
    for block in (slice(0, 10), slice(10, 11), slice(11, 37)):
        matrix[:, block] = VALUES[:, block]
    return matrix


def test_rows_come_back(small, tmp_path):
    matrix = on_disk(tmp_path)
    assert np.array_equal(np.asarray(matrix), VALUES)
    assert np.array_equal(matrix[5:9], VALUES[5:9])
    rows = np.array([3, 4, 700, 999])
    assert np.array_equal(matrix[rows], VALUES[rows])
    assert matrix[rows[:0]].shape == (0, 37)
    assert np.array_equal(np.concatenate([values for _, values in row_blocks(matrix)]), VALUES)


def test_a_full_disk_is_an_error_before_anything_is_traced(small, tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", refuse, raising=False)
    with pytest.raises(OSError, match="No space"):
        keep_matrix(VALUES.shape, tmp_path)
    assert not list(tmp_path.iterdir())


def test_without_fallocate_zeros_are_written(small, tmp_path, monkeypatch):
    monkeypatch.delattr(os, "posix_fallocate", raising=False)
    monkeypatch.setattr(sun_matrix, "ZEROS", 1000)
    assert np.array_equal(np.asarray(on_disk(tmp_path)), VALUES)


def test_workers_can_be_sent_one(small, tmp_path):
    assert np.array_equal(pickle.loads(pickle.dumps(on_disk(tmp_path))), VALUES)


def test_a_run_on_disk_is_the_run_in_memory(monkeypatch, tmp_path):
    suns = suns_towards(np.random.default_rng(1).normal(size=(50, 3)) * [1, 1, 0] + [0, 0, 0.7])
    weather = read_weather("clear-sky", 52.5, 13.4, 30.0)
    energies, transfers = [], []
    for limit in (1 << 28, 256):
        monkeypatch.setattr(sun_matrix, "LIMIT", limit)
        transfers.append(trace_gather(three_houses(), suns, Request(samples=64), silent, tmp_path))
        energies.append(compute_energy(transfers[-1], weather))
    assert is_on_disk(transfers[1].visible_share)
    assert np.array_equal(transfers[0].direct_reflected, np.asarray(transfers[1].direct_reflected))
    assert np.array_equal(energies[0].full_load_hours, energies[1].full_load_hours, equal_nan=True)
    assert np.nansum(energies[0].full_load_hours) > 0
    write_transfer(tmp_path / "transfer.nc", transfers[1])
    assert np.array_equal(
        read_transfer(tmp_path / "transfer.nc").visible_share, transfers[0].visible_share
    )
