"""Open a user's file for reading, packed with gzip or not, and refuse at the door what cannot be read."""

import gzip
import io
import zlib
from pathlib import Path

from ..errors import InputError
from ..progress import untold

LARGEST_GAIN = 200  # bytes unpacked per byte packed; text of cities gains 10 to 30
FREE_BYTES = 64 * 2**20  # small files may gain more
BUFFER = 2**18  # bytes read at once, and between two reports


def open_input(path, tell=untold):
    """Open a file as a stream of bytes.

    Parameters
    ----------
    path : str or path-like
        A file; gzip is recognised by its first bytes, not by its name.
    tell : callable, optional
        `tell(share)` is called now and then with the share of the file that was read, 0 to 1. An exception raised in it
        ends the reading.

    Returns
    -------
    binary stream with ``read``

    Raises
    ------
    InputError
        The file is missing, a folder, empty, not readable or a zip archive.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(path, "no such file", "check the path")
    if path.is_dir():
        raise InputError(path, "is a folder, a file is needed here", "name a file in it")
    try:
        stream, start = _open_told(path, tell)
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})", "check the rights of the file") from error
    if not start:
        stream.close()
        raise InputError(path, "the file is empty", "download or export it again")
    if start == b"PK\x03\x04":
        stream.close()
        raise InputError(path, "is a zip archive", "unpack it and name the files inside")
    if start[:2] == b"\x1f\x8b":
        return io.BufferedReader(_Unpacked(stream, path))
    return stream


def open_text(path):
    """A user's text file, packed with gzip or not, without a byte-order mark.

    Parameters and errors as of `open_input`.

    Returns
    -------
    text stream
    """
    return io.TextIOWrapper(open_input(path), encoding="utf-8-sig", errors="replace")


def _open_told(path, tell):
    """Stream of a file, and its first bytes."""
    stream = io.BufferedReader(_Told(path.open("rb", buffering=0), path.stat().st_size, tell), BUFFER)
    try:
        return stream, stream.peek(4)[:4]
    except BaseException:
        stream.close()
        raise


class _Told(io.RawIOBase):
    """Bytes of a file as they stand, and a word on each read."""

    def __init__(self, file, size, tell):
        self._file, self._size, self._tell, self._count = file, max(size, 1), tell, 0

    def readable(self):
        return True

    def readinto(self, buffer):
        count = self._file.readinto(buffer)
        self._count += count
        self._tell(min(self._count / self._size, 1.0))
        return count

    def close(self):
        self._file.close()
        super().close()


class _Unpacked(io.RawIOBase):
    """Bytes of a gzip file; stops where it unpacks to more than any text does."""

    def __init__(self, packed, path):
        self._path, self._packed, self._count = path, packed, 0
        self._limit = FREE_BYTES + LARGEST_GAIN * path.stat().st_size
        self._stream = gzip.GzipFile(fileobj=packed)

    def readable(self):
        return True

    def readinto(self, buffer):
        try:
            data = self._stream.read(len(buffer))
        except (OSError, EOFError, zlib.error) as error:
            cure = "the file is cut or damaged: get it again"
            raise InputError(self._path, f"byte {self._count} unpacked: gzip breaks off ({error})", cure) from error
        self._count += len(data)
        if self._count > self._limit:
            problem = f"unpacks to more than {self._limit // 2**20} MiB, more than text can gain"
            raise InputError(self._path, problem, "unpack it yourself if you trust it")
        buffer[: len(data)] = data
        return len(data)

    def close(self):
        if not self.closed:
            self._stream.close()
            self._packed.close()
        super().close()
