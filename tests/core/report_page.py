"""What report.html shows in a browser: the numbers beside the picture, and what its pixels ought to
show.
"""

import re
from xml.sax.saxutils import escape

import numpy as np
import pytest
from small_city import FAST, house, write_gml

from citypv.core.commands.command_line import main
from citypv.core.results.read_results import read_results

LEAST, MOST = (8, 8, 4), (16, 16, 20)  # [m] sizes of houses


def simulate_houses(out, names, rng, columns, *options, east=0.0):
    """Results of houses in rows of so many, 24 m apart, whose ids may want to do harm: their
    folder.
    """
    members = [
        house(
            escape(name, {'"': "&quot;"}),
            (east + 24 * (k % columns), 24 * (k // columns)),
            rng.uniform(LEAST, MOST),
        )
        for k, name in enumerate(names)
    ]
    city = write_gml(out.with_suffix(".gml"), *members)
    assert main(["simulate", str(city), "--out", str(out), *options, *FAST]) == 0
    return out


def shown(page):
    """Rows of the numbers beside the picture: dict of str to str."""
    code = (
        "[...document.querySelector('#city-chosen table').rows].map((row) => "
        "row.innerText.split('\\t'))"
    )
    return dict(page.run(code))


def numbers(text):
    return [float(part.replace(",", "")) for part in re.findall(r"-?\d[\d,]*\.?\d*", text)]


def shown_parts(page):
    """Area, kWp, MWh and hours of the parts of the chosen building: dict of str to list
    of float.
    """
    rows = page.run(
        "[...document.querySelector('#city-chosen table').tBodies[0].rows].map((row) => "
        "row.innerText)"
    )
    return {row.split("\t")[0]: [numbers(text)[0] for text in row.split("\t")[1:]] for row in rows}


def on_counted_area(faces, column):
    """Column of faces.csv as a mean over the open area: its means are over whole polygons."""
    return faces[column] * faces["area"] / faces["open_area"]


def slide(page, hours):
    """Ask for so many least hours by the slider: its sentence, and what the table has of facades,
    roofs and all.
    """
    page.run(f"byId('least').value = {hours}; byId('least').dispatchEvent(new Event('input')); 1")
    rows = page.run("[...byId('sums').tBodies[0].rows].map((row) => row.innerText)")
    table = {row.split("\t")[0]: [*map(numbers, row.split("\t")[1:])] for row in rows}
    return page.run("byId('left').textContent"), table


def check_slider(page, faces):
    """What is left above some hours is a sum over the rows of faces.csv that carry modules."""
    rows = faces[(faces["kwp"] > 0) & faces["eligible"]]
    hours, kwp = on_counted_area(rows, "full_load_hours"), rows["kwp"]
    most = page.run("Number(byId('least').max)")
    assert 0 <= most - hours.max() <= 10
    for least in (0, *(10 * np.round(hours.quantile([0.1, 0.4, 0.8]) / 10)), most):
        sentence, table = slide(page, least)
        pays = hours >= least
        for title, own in (
            ("Facades", rows["kind"] == "facade"),
            ("Roofs", rows["kind"] != "facade"),
            ("All", rows["kind"] != ""),
        ):
            power, energy = kwp[own & pays].sum(), (kwp * hours)[own & pays].sum() / 1000
            whole = (kwp * hours)[own].sum() / 1000
            told = [one[0] if one else np.nan for one in table[title]]
            assert told[:2] == pytest.approx([power, energy], rel=1e-5, abs=0.51)
            assert told[3] == pytest.approx(100 * energy / whole, abs=0.51)
            if power:
                assert told[2] == pytest.approx(1000 * energy / power, abs=0.51)
        assert numbers(sentence)[:2] == [table["All"][0][0], table["All"][1][0]]
    slide(page, 0)


class Picture:
    """What rays through places of the window meet, by planes and convex polygons: neither three.js
    nor Embree.
    """

    def __init__(self, page, folder, bring=np.asarray):
        outlines = read_results(folder).outlines
        rings = [outlines.rings(surface)[0] for surface in range(len(outlines.surface_start) - 1)]
        padded = [
            np.concatenate([ring, np.repeat(ring[-1:], 5 - len(ring), axis=0)]) for ring in rings
        ]
        self.corners = bring(np.array(padded, float))  # (n, 5, 3) in the frame of the page
        self.normal = np.cross(
            self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0]
        )
        self.frame = self.frame_of(page)
        self.origin, target = np.array(
            page.run("[view.camera.position.toArray(), view.controls.target.toArray()]")
        )
        self.ahead = (target - self.origin) / np.linalg.norm(target - self.origin)
        right = np.cross(self.ahead, [0, 0, 1])
        self.right = right / np.linalg.norm(right)
        # per pixel
        self.scale = 2 * np.tan(np.radians(page.run("view.camera.fov") / 2)) / self.frame[3]

    @staticmethod
    def frame_of(page):
        """Left, top, width and height of the picture in the window."""
        return np.array(
            page.run("Object.values(view.canvas.getBoundingClientRect().toJSON()).slice(0, 4)")
        )

    def meet(self, x, y):
        """The nearest surface, and where it is met; -1 for none."""
        left, top, width, height = self.frame
        across, upward = (x - left - width / 2) * self.scale, (top + height / 2 - y) * self.scale
        ray = self.ahead + across * self.right + upward * np.cross(self.right, self.ahead)
        distance = np.einsum("nk,nk->n", self.corners[:, 0] - self.origin, self.normal) / (
            self.normal @ ray
        )
        hit = self.origin + distance[:, None] * ray
        along = np.roll(self.corners, -1, axis=1) - self.corners
        side = np.einsum("nck,nk->nc", np.cross(along, hit[:, None] - self.corners), self.normal)
        inside = ((side >= 0).all(axis=1) | (side <= 0).all(axis=1)) & (distance > 0)
        return int(np.argmin(np.where(inside, distance, np.inf))) if inside.any() else -1

    def places(self, count, seed):
        """Random places whose neighbours show the same, with what they show: list of (x, y,
        surface).
        """
        rng, found = np.random.default_rng(seed), []
        while len(found) < count:
            # Buttons stand above these places, the legend below them.
            x, y = self.frame[:2] + rng.uniform(0.2, (0.8, 0.72)) * self.frame[2:]
            met = {
                self.meet(x + dx, y + dy) for dx, dy in ((0, 0), (2, 0), (-2, 0), (0, 2), (0, -2))
            }
            if len(met) == 1:
                found.append((x, y, met.pop()))
        return found
