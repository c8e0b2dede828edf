"""Wheels without the tests of their packages, which take a tenth of some; everything else stays as
it is.
"""

import re
import shutil
import zipfile

TESTS = re.compile(r"(^|/)tests?/")
WORTH = 0.5e6  # [B] of tests, as packed: below this a wheel stays unmodified


def copy_wheel(wheel, folder):
    """Copy a wheel to a folder, without tests where these are large.

    Parameters
    ----------
    wheel : Path
    folder : Path
    """
    with zipfile.ZipFile(wheel) as whole:
        tests = {item.filename for item in whole.infolist() if TESTS.search(item.filename)}
        if sum(whole.getinfo(name).compress_size for name in tests) < WORTH:
            shutil.copy(wheel, folder)
            return
        with zipfile.ZipFile(folder / wheel.name, "w", zipfile.ZIP_DEFLATED) as slim:
            for item in whole.infolist():
                if item.filename not in tests:
                    slim.writestr(item, strike_out(item.filename, whole.read(item), tests))


def strike_out(name, data, tests):
    """Contents of a file of a wheel; the list of all files, RECORD, without those that are left
    out.
    """
    if not name.endswith(".dist-info/RECORD"):
        return data
    lines = data.decode().splitlines(keepends=True)
    return "".join(
        line for line in lines if line.partition(",")[0].strip('"') not in tests
    ).encode()
