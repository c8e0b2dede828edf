"""Cancelled while files are read: nothing is there that was not there before."""

import bpy
import pytest
from steps import here, run, session_here

from citypv.core.city.join_contents import JOINING
from citypv.core.read.read_city import READING
from citypv.core.settings.progress import CancelledError
from citypv.operators import run_step
from citypv.operators.session import find_session


def stand():
    """What Blender's file holds, by kind."""
    kinds = "objects", "meshes", "materials", "collections", "images", "texts"
    return {kind: sorted(one.name for one in getattr(bpy.data, kind)) for kind in kinds}


@pytest.mark.parametrize("stage", [READING, JOINING, "triangulating"])
def test_nothing_is_left_of_a_cancelled_import(addon, city_file, row_file, monkeypatch, stage):
    """An earlier city stays as it was, with its session."""
    earlier = run("import_city", city_path=str(row_file))
    seen, session = stand(), find_session(earlier)

    def cancel(now, done, total, unit):
        if now == stage:
            raise CancelledError

    monkeypatch.setattr(run_step, "silent", cancel)
    addon.city_path = str(city_file)
    with pytest.raises(RuntimeError, match="CancelledError"):
        bpy.ops.citypv.import_city()
    assert stand() == seen
    assert here() == earlier
    assert find_session(earlier) is session
    monkeypatch.undo()
    run("import_city")
    assert len(session_here().city) == 21
