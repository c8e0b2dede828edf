"""Open an input file, plain or gzip-compressed, and reject early what cannot be read."""

import gzip
import io
import zlib
from pathlib import Path

from ..settings.errors import InputError
from ..settings.progress import ignore_share

LARGEST_GAIN = 200  # highest compression ratio accepted; text of city models has 10 to 30
FREE_BYTES = 64 * 2**20  # decompressed size that is always accepted
BUFFER = 2**18  # bytes per read and per progress report


def open_input(path, report_share=ignore_share):
    """Open a file as a stream of bytes.

    Parameters
    ----------
    path : str or path-like
        A file; gzip is recognised by its first bytes, not by its name.
    report_share : callable, optional
        Called repeatedly with the share of the file read so far, 0 to 1. An exception raised in it
        stops reading.

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
        raise InputError(path, "is a folder, but a file is expected", "give a file in it")
    try:
        stream, start = _open_reporting(path, report_share)
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})", "check the file permissions") from error
    if not start:
        stream.close()
        raise InputError(path, "the file is empty", "download or export it again")
    if start == b"PK\x03\x04":
        stream.close()
        raise InputError(path, "is a zip archive", "unpack it and give the files inside")
    if start[:2] == b"\x1f\x8b":
        return io.BufferedReader(_Decompressed(stream, path))
    return stream


def open_text(path):
    """Open a text file, plain or gzip-compressed; a byte-order mark is skipped.

    Parameters and errors as in `open_input`.

    Returns
    -------
    text stream
    """
    return io.TextIOWrapper(open_input(path), encoding="utf-8-sig", errors="replace")


def _open_reporting(path, report_share):
    """Stream of a file that reports progress, and its first bytes."""
    stream = io.BufferedReader(_Reporting(path.open("rb", buffering=0), path.stat().st_size, report_share), BUFFER)
    try:
        return stream, stream.peek(4)[:4]
    except BaseException:
        stream.close()
        raise


class _Reporting(io.RawIOBase):
    """Raw bytes of a file; each read is reported."""

    def __init__(self, file, size, report_share):
        self._file, self._size, self._report_share, self._count = file, max(size, 1), report_share, 0

    def readable(self):
        return True

    def readinto(self, buffer):
        count = self._file.readinto(buffer)
        self._count += count
        self._report_share(min(self._count / self._size, 1.0))
        return count

    def close(self):
        self._file.close()
        super().close()


class _Decompressed(io.RawIOBase):
    """Decompressed bytes of a gzip file; stops at a decompression bomb."""

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
            cure = "the file is truncated or damaged: download or export it again"
            raise InputError(
                self._path, f"decompression fails at byte {self._count} of the output ({error})", cure
            ) from error
        self._count += len(data)
        if self._count > self._limit:
            problem = f"decompresses to more than {self._limit // 2**20} MiB, an implausible compression ratio"
            raise InputError(self._path, problem, "decompress it yourself if you trust it")
        buffer[: len(data)] = data
        return len(data)

    def close(self):
        if not self.closed:
            self._stream.close()
            self._packed.close()
        super().close()
