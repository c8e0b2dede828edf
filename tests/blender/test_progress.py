"""What the panel says of a running step: its stage, the share of the whole step, and the time left
once it is known.
"""

from types import SimpleNamespace

import bpy
import pytest
from steps import run

from citypv.core.city.join_contents import JOINING
from citypv.core.rays import hemisphere_rays
from citypv.core.rays.compile_ahead import read_loops
from citypv.core.read.read_city import READING
from citypv.core.settings.progress import SUN_STAGE
from citypv.operators.city import job as jobs
from citypv.operators.city import run_step
from citypv.operators.city.job import COMPILING, Job, describe_left, share_of_step
from citypv.operators.run import classify_city
from citypv.operators.run.classify_city import ClassifyCity
from citypv.operators.run.compute_energy import WeighEnergy
from citypv.operators.run.import_city import ImportCity
from citypv.operators.run.trace_city import TraceCity

STAGES = {"sky": 3.0, "suns": 1.0}


def test_the_share_is_that_of_the_whole_step_and_never_falls():
    assert share_of_step(STAGES, "sky", 0.5, 0.0) == pytest.approx(0.375)
    assert share_of_step(STAGES, "suns", 0.0, 0.4) == pytest.approx(0.75)
    assert share_of_step(STAGES, "suns", 1.0, 0.9) == 1.0
    assert share_of_step(STAGES, "sky", 0.0, 0.8) == 0.8
    assert share_of_step(STAGES, "unknown", 0.5, 0.3) == 0.3
    assert share_of_step({}, "any", 0.5, 0.9) == 0.5


def test_a_time_left_is_told_once_it_is_worth_something():
    assert describe_left(1.0, 0.5) == ""  # too early
    assert describe_left(60.0, 0.02) == ""  # too little done
    assert describe_left(20.0, 0.25) == "about 60 s left"
    assert describe_left(60.0, 0.25) == "about 3 min left"
    assert describe_left(60.0, 1.0) == ""


def test_a_job_tells_stage_rate_and_share(monkeypatch):
    now = 100.0
    monkeypatch.setattr(jobs.time, "monotonic", lambda: now)
    job = Job("Trace light", lambda progress: None, STAGES)
    for now, rate in ((100.0, ""), (100.1, ""), (102.0, "25 rays/s")):
        job.progress("sky", 50 if now > 100 else 0, 100, "rays")
        assert job.rate == rate
    assert (job.stage, job.share, job.left) == ("sky", 0.375, "")
    assert job.text == f"sky: 38 %, {job.rate}"


def test_the_time_of_compiling_is_not_counted_in_the_time_left(monkeypatch):
    now = 100.0
    monkeypatch.setattr(jobs.time, "monotonic", lambda: now)
    job = Job("Trace light", lambda progress: None, {COMPILING: 1.0, "sky": 9.0})
    for stage, now in ((COMPILING, 101.0), (COMPILING, 141.0), ("sky", 141.0), ("sky", 150.0)):
        job.progress(stage, (now - 101) / 40 if stage == COMPILING else (now - 141) / 18, 1, "")
        assert job.left == ("about 9 s left" if now == 150 else "")  # 9 s for half of the rest


@pytest.mark.slow
def test_every_stage_of_the_steps_is_expected(addon, city_file, monkeypatch):
    """As reported by core while the whole chain runs, in the order that the operators expect."""
    told = []
    monkeypatch.setattr(run_step, "silent", lambda stage, done, total, unit: told.append(stage))
    addon.city_path, addon.samples, addon.shadow_samples, addon.days = str(city_file), 16, 2, 2
    addon.sky = "perez"
    for operator in (ImportCity, ClassifyCity, TraceCity, WeighEnergy):
        told.clear()
        assert getattr(bpy.ops.citypv, operator.bl_idname.partition(".")[2])() == {"FINISHED"}
        stages = operator.stages
        if operator is TraceCity:
            step = SimpleNamespace()
            TraceCity.prepare(step, bpy.context)
            stages = step.stages
            assert SUN_STAGE in stages
        seen = list(dict.fromkeys(told))
        assert [name for name in stages if name in seen] == seen
    assert {READING, JOINING} < set(ImportCity.stages)


def test_compiling_is_a_stage_of_its_own(addon, city_file, monkeypatch):
    told = []
    monkeypatch.setattr(
        run_step, "silent", lambda stage, done, total, unit: told.append((stage, done, total))
    )
    monkeypatch.setattr(hemisphere_rays, "is_compiled", lambda: False)
    run("import_city", "classify", city_path=str(city_file))
    steps = [
        done / total
        for stage, done, total in told
        if stage == "compiling for this computer, only once"
    ]
    assert steps == [place / len(read_loops()) for place in range(len(read_loops()) + 1)]
    inside = [done / total for stage, done, total in told if stage == "finding interior surfaces"]
    assert inside[0] == 0
    assert inside[-1] == 1
    assert classify_city.COMPILING in ClassifyCity.stages
    monkeypatch.undo()
    assert hemisphere_rays.is_compiled()
