"""Open an input file, plain or gzip-compressed, and reject early what cannot be read; limits on
what files may hold.
"""

import csv
import gzip
import io
import zipfile
import zlib
from contextlib import ExitStack, contextmanager
from pathlib import Path

from ..settings.errors import InputError
from ..settings.memory import GB, free_memory
from ..settings.progress import silent

LARGEST_GAIN = 200  # highest compression ratio accepted; text of city models has 10 to 30
FREE_BYTES = 64 * 2**20  # decompressed size that is always accepted
BUFFER = 2**18  # bytes per read and per progress report
LARGEST_COORDINATE = 1e8  # [m, ft or °] larger than any coordinate on Earth in any system
CUT = "the file is truncated or damaged: download or export it again"


class Budget:
    """Memory that reading a file may take: as much as city models take, and no more than is free.

    Parameters
    ----------
    path : path-like
    step : str
        What is too large, as "holds a text".
    cure : str
    """

    def __init__(self, path, step, cure):
        self._told, self._spent, self._most = (path, step, cure), 0, None  # [bytes]

    def spend(self, count):
        """Take some bytes from it.

        Raises
        ------
        InputError
            More than is left.
        """
        self._spent += count
        # What is free takes a millisecond to ask, too long for each of a million short lines.
        if self._spent < 2**24:
            return
        path, step, cure = self._told
        if self._most is None:
            free = free_memory()
            # Any file may take 768 MB, and 64 bytes per byte of its own; a city model takes 12.
            most = 3 * 2**28 + 64 * Path(path).stat().st_size
            self._most = most if free is None else min(most, free)
        if self._spent > self._most:
            raise InputError(
                path, f"{step} too large for memory: more than {self._most / GB:.1f} GB", cure
            )


def clean_name(text):
    """A name that fits into one line of a table: no control characters or lone surrogates, limited
    in length.
    """
    text = text[:200]
    return (
        text
        if text.isprintable()
        else "".join(sign if sign.isprintable() else "\ufffd" for sign in text)
    )


def suffix_of(path):
    """Suffix of a file in lower case, without the compression's."""
    return next(
        (suffix.lower() for suffix in reversed(Path(path).suffixes) if suffix.lower() != ".gz"), ""
    )


def open_input(path, report_share=silent):
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
    try:
        if not path.exists():
            raise InputError(path, "no such file", "check the path")
        if path.is_dir():
            raise InputError(path, "is a folder, but a file is expected", "give a file in it")
        if not path.is_file():  # it could be waited for without end, and is read twice
            raise InputError(
                path, "is a pipe or a device, but a file is expected", "save it as a file first"
            )
        with ExitStack() as opened:
            stream = opened.enter_context(io.BufferedReader(_Reporting(path, report_share), BUFFER))
            start = stream.peek(4)[:4]
            if not start:
                raise InputError(path, "the file is empty", "download or export it again")
            if start == b"PK\x03\x04":
                raise InputError(path, "is a zip archive", "unpack it and give the files inside")
            opened.pop_all()
    except OSError as error:
        raise InputError(
            path, f"cannot be read ({error.strerror})", "check the file permissions"
        ) from error
    return io.BufferedReader(_Decompressed(stream, path)) if start[:2] == b"\x1f\x8b" else stream


def open_text(path):
    """Open a text file, plain or gzip-compressed; a byte-order mark is skipped.

    Parameters and errors as in `open_input`.

    Returns
    -------
    text stream
    """
    return io.TextIOWrapper(open_input(path), encoding="utf-8-sig", errors="replace")


def read_text(path):
    """All of a text file, as `open_text` opens it: str."""
    with open_text(path) as file:
        return file.read()


class _Reporting(io.FileIO):
    """Raw bytes of a file; each read is reported."""

    def __init__(self, path, report_share):
        super().__init__(path)
        self._size, self._report_share = max(path.stat().st_size, 1), report_share

    def readinto(self, buffer):
        count = super().readinto(buffer)
        self._report_share(min(self.tell() / self._size, 1.0))
        return count


class _Decompressed(io.RawIOBase):
    """Decompressed bytes of a gzip file; stops at a decompression bomb."""

    def __init__(self, packed, path):
        self._path, self._packed, self._stream = path, packed, gzip.GzipFile(fileobj=packed)
        self._limit = FREE_BYTES + LARGEST_GAIN * path.stat().st_size

    def readable(self):
        return True

    def readinto(self, buffer):
        try:
            count = self._stream.readinto(buffer)
        except (OSError, EOFError, zlib.error) as error:
            problem = f"decompression fails at byte {self._stream.tell()} of the output ({error})"
            raise InputError(self._path, problem, CUT) from error
        if self._stream.tell() > self._limit:
            problem = (
                f"decompresses to more than {self._limit // 2**20} MiB, an implausible compression "
                "ratio"
            )
            raise InputError(self._path, problem, "decompress it yourself if you trust it")
        return count

    def close(self):
        self._stream.close()
        self._packed.close()
        super().close()


@contextmanager
def open_zip(path):
    """A zip archive whose files have a plausible size, open: zipfile.ZipFile.

    Raises
    ------
    InputError
        What it unpacks to is far larger than itself.
    """
    with zipfile.ZipFile(path) as archive:
        size = sum(member.file_size for member in archive.infolist())
        if size > FREE_BYTES + LARGEST_GAIN * Path(path).stat().st_size:
            raise InputError(
                path, f"unpacks to {size / 1e9:.1f} GB, an implausible ratio", "unpack it yourself"
            )
        yield archive


def read_rows(path, cure):
    """Rows of a small table of the user, CSV in UTF-8, as ids must be exact: iterator of list of
    str.

    Parameters
    ----------
    path : path-like
    cure : str
        What to give where it cannot be read.

    Raises
    ------
    InputError
    """
    try:
        with open_input(path) as stream:
            text = stream.read().decode("utf-8-sig")
    except InputError:
        raise
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(path, f"cannot be read ({error})", cure) from error
    return csv.reader(text.splitlines())
