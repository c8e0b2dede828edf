"""What a map of the world cannot be made from is refused in one line."""

from dataclasses import replace

import numpy as np
import pytest

from citypv.core.commands.command_line import main
from citypv.core.energy.pv_system import dc_system
from citypv.core.settings.errors import InputError
from citypv.core.sun.horizon import STEPS, TerrainHorizon
from citypv.core.sun.sky_grid import sky_grid_suns
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.sun.suns import interrupted_suns
from citypv.core.world.environment import build_environment

from .transfers import Horizons
from .weathers import BARROW, ERA5, HOUR, year_of


def test_other_suns_than_a_sky_grid_are_refused_with_what_to_run():
    system = dc_system()
    whole, flat = (Horizons(9).transfer(sky_grid_suns(16)) for _ in range(2))
    flat.surfaces.eligible[:] = False
    days = Horizons(9).transfer(choose_suns("days:2", year_of(), HOUR, 52.5, 13.4))
    part = Horizons(9).transfer(replace(interrupted_suns(sky_grid_suns(100), 40), sampling="sky-grid:100"))
    for transfer, words in (
        (days, r"days:2, which holds for one latitude only; .*--suns sky-grid"),
        (part, "40 directions"),
        (replace(whole, terrain=TerrainHorizon(np.full(STEPS, 5.0))), "again without --horizon"),
        (replace(whole, bare=whole, leaf_months=(5, 6)), "--leaf-months all"),
        (flat, "no eligible"),
    ):
        with pytest.raises(InputError, match=words):
            build_environment("town", "transfer.nc", transfer, system)
    with pytest.raises(InputError, match="--sky isotropic"):
        build_environment("town", "transfer.nc", whole, system, "perez")


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
