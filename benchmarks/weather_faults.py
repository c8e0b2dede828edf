"""False alarms of the checks of weather records, and how many of seven faults they find in the same
records.

    python benchmarks/weather_faults.py FILE… > benchmarks/results/weather_faults.md

One row per year of a file: what all checks say of the file; what those of faults say of the year,
even where others refuse the file (stamps off by half an hour, for instance); and which faults pass
unseen when those of the tests are put into it. A record that came under another name before is left
out.
"""

import sys
import warnings
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "core"))
from test_weather_faults import FAULTS, LIGHT, faults_of

from citypv.core.settings.errors import InputError
from citypv.core.weather.add_sun import add_sun
from citypv.core.weather.check_weather import check_weather, cut_years
from citypv.core.weather.read_weather import Reading, check_record, read_files

BERLIN = 52.51, 13.39, 34.0  # of files without a place


def main(paths):
    """Print the table, and the counts below it."""
    warnings.simplefilter("ignore")
    print(
        "| record | year | GHI | all checks | checks of faults | faults unseen "
        "|\n|---|---|--:|---|---|---|"
    )
    seen, refused, noted, found, tried = set(), 0, 0, 0, 0
    for path in map(Path, paths):
        try:
            (record,) = read_files([path], BERLIN, Reading())
            interval = check_weather(record)
        except InputError as error:
            print(f"| {path.name} | – | – | {error.problem} | – | – |")
            continue
        door = judge(lambda record: (check_record(record), [])[1], record)
        for year, rows in cut_years(record, interval).items():
            one = replace(record, data=record.data.iloc[rows], source=path.name)
            light = add_sun(one, interval).data
            ghi = light["ghi"].sum() * interval.total_seconds() / 3.6e6
            if (round(record.latitude, 1), round(ghi)) in seen:
                continue
            seen.add((round(record.latitude, 1), round(ghi)))
            whole = replace(one, data=light[[*LIGHT, "temp_air", "wind_speed", "pressure"]])
            own, unseen = judge(faults_of, whole), []
            for fault in FAULTS:
                spoilt = replace(whole, data=whole.data.copy())
                fault(spoilt.data)
                unseen += (
                    [fault.__name__.replace("_", " ")] if judge(faults_of, spoilt) == own else []
                )
            refused, noted = refused + own.startswith("refused"), noted + own.startswith("noted")
            found, tried = found + len(FAULTS) - len(unseen), tried + len(FAULTS)
            print(
                f"| {path.name} | {year} | {ghi:,.0f} | {door} | {own} | {', '.join(unseen)} |",
                flush=True,
            )
    judged = f"{refused} refused, {noted} noted by the checks of faults"
    print(f"\n{len(seen)} years: {judged}; {found} of {tried} faults found.")


def judge(check, record):
    """`passes`, `noted: …` or `refused: …`."""
    try:
        notes = check(record)
    except InputError as error:
        return f"refused: {error.problem}"
    return f"noted: {'; '.join(notes)}" if notes else "passes"


if __name__ == "__main__":
    with suppress(BrokenPipeError):
        main(sys.argv[1:])
