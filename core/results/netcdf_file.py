"""A file for the HDF5 library to write to, which keeps an error until the library has closed it."""

import errno
import io
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def netcdf_file(path):
    """Create a file that HDF5 writes to.

    HDF5 cannot close a file that it could not write in full, and crashes the process at its end. So it is told that all
    is well, what it writes after the first error is dropped, and the error is raised in the end.

    Parameters
    ----------
    path : path-like

    Yields
    ------
    binary stream

    Raises
    ------
    OSError
        The system refused to write: the disk is full, for instance.
    """
    with Path(path).open("w+b", buffering=0) as raw:
        stream = KeptError(raw)
        yield stream
    if stream.error is not None:
        words = f"cannot be written ({stream.error.strerror}): is the disk full?"
        raise OSError(stream.error.errno or errno.EIO, words, str(path)) from stream.error


class KeptError(io.RawIOBase):
    """An open file that keeps the first error of writing, and from then on drops what is written."""

    def __init__(self, raw):
        self._raw, self.error, self._place = raw, None, 0

    def readable(self):
        """Return True."""
        return True

    def writable(self):
        """Return True."""
        return True

    def seekable(self):
        """Return True."""
        return True

    def seek(self, offset, whence=io.SEEK_SET):
        """Move to a place."""
        self._place = self._raw.seek(offset, whence)
        return self._place

    def tell(self):
        """Return the place in the file."""
        return self._raw.tell()

    def readinto(self, buffer):
        """Read; zeros where the file could not be written."""
        count = self._raw.readinto(buffer)
        if self.error is not None and count < len(buffer):
            buffer[count:] = bytes(len(buffer) - count)
            return len(buffer)
        return count

    def write(self, data):
        """Write all of some bytes."""
        view = memoryview(data).cast("B")
        while self.error is None and len(view):
            try:
                view = view[self._raw.write(view) :]
            except OSError as error:
                self.error = error
        return len(data)

    def truncate(self, size=None):
        """Cut or extend the file."""
        if self.error is None:
            try:
                return self._raw.truncate(size)
            except OSError as error:
                self.error = error
        return size

    def flush(self):
        """Nothing is held back."""
