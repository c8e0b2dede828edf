"""What a map of the world cannot be made from is refused in one line."""

from dataclasses import replace

import numpy as np
import pytest

from citypv.core.commands.command_line import main
from citypv.core.energy.pv_system import default_system
from citypv.core.horizon.horizon import STEPS, TerrainHorizon
from citypv.core.settings.errors import InputError
from citypv.core.sun.choose_suns import choose_suns
from citypv.core.sun.keep_suns import keep_suns
from citypv.core.sun.sky_grid import sky_grid_suns
from citypv.core.world.environment import build_environment

from .transfers import Horizons
from .weathers import BARROW, ERA5, HOUR, year_of


def test_other_suns_than_a_sky_grid_are_refused_with_what_to_run():
    system = default_system()
    times = year_of()
    suns = choose_suns("days:2", times, HOUR, 52.5, 13.4)
    with pytest.raises(InputError, match=r"days:2, which holds for one latitude only; .*--suns sky-grid"):
        build_environment("town", "transfer.nc", Horizons(9).transfer(suns), system)
    part = keep_suns(sky_grid_suns(100), 40)
    with pytest.raises(InputError, match="40 directions"):
        build_environment("town", "transfer.nc", Horizons(9).transfer(replace(part, way="sky-grid:100")), system)
    with pytest.raises(InputError, match="--sky isotropic"):
        build_environment("town", "transfer.nc", Horizons(9).transfer(sky_grid_suns(16)), system, "perez")
    whole = Horizons(9).transfer(sky_grid_suns(16))
    with pytest.raises(InputError, match="again without --horizon"):
        build_environment("town", "transfer.nc", replace(whole, terrain=TerrainHorizon(np.full(STEPS, 5.0))), system)
    with pytest.raises(InputError, match="--leaf-months all"):
        build_environment("town", "transfer.nc", replace(whole, bare=whole, leaf_months=(5, 6)), system)
    flat = Horizons(9).transfer(sky_grid_suns(16))
    flat.surfaces.eligible[:] = False
    with pytest.raises(InputError, match="no eligible"):
        build_environment("town", "transfer.nc", flat, system)


def test_command_line_refuses_in_one_line(tmp_path, capsys):
    cases = (
        (["nothing.nc"], "no such file"),
        (["unshaded", "unshaded"], "two are called"),
        (["unshaded", "--mix", "berlin=1"], "no environment"),
        (["unshaded", "--step", "0"], "no step"),
        (["unshaded", "--latitudes", "20", "10"], "no range"),
        (["unshaded", "--years", "2015"], "typical year"),
        (["unshaded", "--losses", "10"], "--losses"),
        (["unshaded", "--weather", str(BARROW), "missing.nc"], "missing.nc"),
        (["unshaded", "--mix", ""], "--mix: the weights add up to 0"),
        (["unshaded", "mix=unshaded", "--mix", "unshaded=0.5,mix=0.5", "--step", "90"], "is called 'mix'"),
        (["unshaded", "--weather", "clear-sky", "--off-land", "clear-sky"], "--off-land: means nothing for clear-sky"),
    )
    for arguments, words in cases:
        assert main(["world", *arguments, "--quiet", "--out", str(tmp_path / "out")]) == 2
        error = capsys.readouterr().err
        assert error.count("\n") == 1
        assert words in error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("weather", "option", "words"),
    [
        (BARROW, ["--years", "2003"], "for stations"),
        (BARROW, ["--latitudes", "0", "10"], "for stations"),
        (BARROW, ["--longitudes", "0", "10"], "for stations"),
        (BARROW, ["--step", "5"], "for stations"),
        (BARROW, ["--off-land", "clear-sky"], "for stations"),
        (ERA5, ["--off-land", "clear-sky"], "for gridded weather"),
        (ERA5, ["--longitudes", "0", "360"], "-180 to 180"),  # half of them would be left out: places lie below 180°
        (ERA5, ["--longitudes", "nan", "10"], "-180 to 180"),
    ],
)
def test_a_region_that_the_weather_cannot_have_is_refused(tmp_path, capsys, weather, option, words):
    command = ["world", "unshaded", "--weather", str(weather), *option, "--pictures", "off", "--quiet"]
    assert main([*command, "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert error.startswith(f"citypv: error: {option[0]}: ")
    assert words in error


def test_the_help_lists_no_option_that_is_refused(capsys):
    assert main(["world", "--help"]) == 0
    listed = capsys.readouterr().out
    assert "--weather-place" in listed
    for name in ("series", "monthly", "losses", "inverter", "allow-distance", "weather-point"):
        assert f"--{name}" not in listed
