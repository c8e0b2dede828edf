"""What a council asks first, for report and solar map: how much, as four numbers, and how sure, as
one sentence.
"""

import math
from html import escape

from .describe_errors import percent
from .describe_run import has_losses
from .words import number, say

YEARS = 8  # [%] by which a year differs from the mean of many at most, as in `OF_RECORDS`


def compose_headline(summary):
    """The four numbers and the sentence below them, as HTML: str.

    Parameters
    ----------
    summary : dict
        summary.json, of a map the sums of several.
    """
    totals = summary["totals"]
    cards = [_modules(totals), _power(totals), _energy(totals), _shares(totals)]
    lines = ['<dl class="cards">']
    for title, figure, words, more in cards:
        lines.append(
            f'<div class="card"><dt>{escape(title)}</dt><dd class="figure">{figure}</dd>'
            f"{more}<dd>{escape(words)}</dd></div>"
        )
    told = escape(describe_certainty(summary)).replace("± ", "±&nbsp;")
    sure = f"<b>{escape(say('How sure?'))}</b> {told}"
    return "\n".join([*lines, "</dl>", f'<p class="sure">{sure}</p>'])


def _figure(text, unit=""):
    """A large number with its small unit."""
    return f"{escape(text)} <small>{escape(unit)}</small>" if unit else escape(text)


def _modules(totals):
    """How many modules; where they are not laid out, their area."""
    area = number(totals["module_area"])
    if totals.get("layout") == "rows" and totals.get("module_count"):
        words = say("{area} m² on roofs and facades", area=area)
        return say("Solar modules"), _figure(number(totals["module_count"])), words, ""
    words = say("on every square metre of roofs and facades that counts")
    return say("Area of modules"), _figure(area, "m²"), words, ""


def _power(totals):
    """Nominal power, and the area that a kilowatt takes."""
    words = say("{area:,.2f} m² for each kWp", area=totals["area_per_kwp"])
    return say("Power"), _figure(number(totals["kwp"]), "kWp"), words, ""


def _energy(totals):
    """Energy of a year, in GWh from one on, and of a kilowatt."""
    energy, title = totals["mwh_per_year"], say("Energy in a year")
    large = energy >= 1000
    figure = _figure(number(energy / 1000 if large else energy, ",.2f"), "GWh" if large else "MWh")
    if not totals["kwp"]:
        return title, figure, say("no surface carries modules"), ""
    hours = 1000 * energy / totals["kwp"]
    return title, figure, say("{hours:,.0f} kWh for each kWp", hours=hours), ""


def _shares(totals):
    """What roofs and what facades give of the energy, with a bar in their colours."""
    whole = totals["mwh_per_year"]
    facades = (totals["kinds"].get("facade") or {}).get("mwh_per_year", 0.0)
    if not whole:
        return say("Roofs and facades"), "–", say("no surface carries modules"), ""
    share = round(100 * (whole - facades) / whole)
    bar = (
        '<dd aria-hidden="true"><svg viewBox="0 0 100 1" preserveAspectRatio="none">'
        f'<rect class="roofs" width="{share}" height="1" stroke="none"/>'
        f'<rect class="facades" x="{share}" width="{100 - share}" height="1" stroke="none"/>'
        "</svg></dd>"
    )
    words = say("{roofs:,.0f} MWh and {facades:,.0f} MWh", roofs=whole - facades, facades=facades)
    figure = _figure(f"{share} : {100 - share}", "%")
    return say("Roofs : facades"), figure, words, bar


def describe_certainty(summary):
    """How far the energy holds: plain sentences on the weather, the calculation, and what is left.

    Several years of weather tell their own spread; a single one may be off by what years differ
    elsewhere; the built-in climate errs by what it did where it was compared.
    """
    budget, totals = summary["error_budget"], summary["totals"]
    shift = (budget.get("sun_sampling") or {}).get("bias")
    known = None not in (shift, budget.get("sampling_total"))
    # Errors of chance and of the choice of suns together; less than 0.1 % is told as 0.1 %, as it
    # does not matter beside the weather. A run that lacks one of them says so.
    calculated = (
        say(
            "The calculation itself is known to ± {error}.",
            error=percent(max(math.hypot(budget["sampling_total"], shift), 0.1)),
        )
        if known
        else say("How far the calculation itself is known this run does not tell.")
    )
    count = int(summary["weather"].get("years") or 1)
    if "p90_mwh_per_year" in totals:
        weather = say(
            "Of the {count} years of the weather, nine of ten bring at least {energy}.",
            count=count,
            energy=_words_of_energy(totals["p90_mwh_per_year"]),
        )
    elif "climatology" in summary["weather"]["label"]:
        weather = say(
            "The weather is a built-in climate, not a measurement: with it facades were 5 to 11 % too "
            "high on average. For a design use measured or satellite data."
        )
    else:
        energy, part = totals["mwh_per_year"], YEARS / 100
        weather = say(
            "From year to year the sun alone changes the energy by up to {share} %: a dull year may "
            "bring {low}, a sunny one {high}.",
            share=YEARS,
            low=_words_of_energy((1 - part) * energy),
            high=_words_of_energy((1 + part) * energy),
        )
    rest = (
        say("Errors of the city model, the modules and the losses come on top.")
        if has_losses(summary)
        else say("Errors of the city model and the modules come on top; losses are not counted.")
    )
    return f"{weather} {calculated} {rest}"


def _words_of_energy(energy):
    """Energy [MWh] in GWh from one on, else in MWh."""
    if energy >= 1000:
        return say("{energy:,.1f} GWh", energy=energy / 1000)
    return say("{energy:,.1f} MWh", energy=energy)
