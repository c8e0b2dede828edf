"""A server of this machine that answers as the weather services document, or refuses, or waits."""

import io
import json
import sys
import threading
import time
import zipfile
from contextlib import contextmanager
from functools import cache
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import urlsplit

import pandas as pd
import pvlib
from weathers import BERLIN, ERA5, HOUR

from citypv.core.weather import ask_services
from citypv.core.weather.read_weather import read_weather

BOTH = ["ghi", "dhi"]
# [Wm⁻²] as each service writes
ROUNDED = {
    "pvgis": 0.006,
    "nasa-power": 0.006,
    "era5": 1e-6,
    "open-meteo": 0.06,
}
ASKED = {key: f"{key}:2017" for key in ROUNDED}


@cache
def year():
    """Berlin's 2017, by the start of each hour of that calendar year of UTC."""
    data = read_weather(ERA5, *BERLIN).data[["ghi", "dhi", "dni", "temp_air", "wind_speed"]]
    return pd.concat([data.iloc[1:], data.iloc[-24:-23].set_axis(data.index[-1:] + HOUR)])


def answer_pvgis(data):
    """An hourly series of PVGIS, json: the satellite's moment is the middle of the interval."""
    rows = [
        {
            "time": f"{time + HOUR / 2:%Y%m%d:%H%M}",
            "Gb(i)": round(row.ghi - row.dhi, 2),
            "Gd(i)": round(row.dhi, 2),
        }
        | {"Gr(i)": 0.0, "H_sun": 0.0, "T2m": row.temp_air, "WS10m": row.wind_speed, "Int": 0.0}
        for time, row in zip(data.index, data.itertuples(), strict=True)
    ]
    place = {"latitude": BERLIN[0], "longitude": BERLIN[1], "elevation": 40.0}
    return {"inputs": {"location": place}, "outputs": {"hourly": rows}, "meta": {"inputs": {}}}


def answer_power(data):
    """NASA POWER's json: stamps begin the hour."""
    columns = {"ALLSKY_SFC_SW_DWN": "ghi", "ALLSKY_SFC_SW_DIFF": "dhi", "ALLSKY_SFC_SW_DNI": "dni"}
    columns |= {"T2M": "temp_air", "WS10M": "wind_speed"}
    stamps = data.index.strftime("%Y%m%d%H")
    values = {
        name: dict(zip(stamps, data[ours].round(2), strict=True)) for name, ours in columns.items()
    }
    values["PS"] = dict.fromkeys(stamps, 100.2)
    units = dict.fromkeys(values, "Wh/m^2") | {"T2M": "C", "WS10M": "m/s", "PS": "kPa"}
    header = {
        "title": "NASA/POWER Source Native Resolution Hourly Data",
        "fill_value": -999.0,
        "time_standard": "UTC",
    }
    about = {name: {"units": unit, "longname": name} for name, unit in units.items()}
    place = {"type": "Point", "coordinates": [BERLIN[1], BERLIN[0], 41.0]}
    return {
        "geometry": place,
        "properties": {"parameter": values},
        "header": header,
        "parameters": about,
        "times": {},
    }


def answer_open_meteo(data):
    """Open-Meteo's json: radiation ends at the stamp; the hour that ends at 0:00 is of the year
    before.
    """
    rolled = data.iloc[[-1, *range(len(data) - 1)]]
    columns = {
        "shortwave_radiation": "ghi",
        "diffuse_radiation": "dhi",
        "direct_normal_irradiance": "dni",
    }
    columns |= {"temperature_2m": "temp_air", "wind_speed_10m": "wind_speed"}
    hourly = {name: list(rolled[ours].round(1)) for name, ours in columns.items()}
    units = dict.fromkeys(columns, "W/m²") | {
        "time": "iso8601",
        "temperature_2m": "°C",
        "wind_speed_10m": "m/s",
    }
    head = {
        "latitude": 52.548,
        "longitude": 13.4,
        "elevation": 42.0,
        "utc_offset_seconds": 0,
        "timezone": "GMT",
    }
    return head | {
        "hourly_units": units,
        "hourly": {"time": list(data.index.strftime("%Y-%m-%dT%H:%M"))} | hourly,
    }


def answer_era5(data):
    """A zip of the Climate Data Store's csv: sums of the hour that ends at the stamp."""
    rolled = data.iloc[[-1, *range(len(data) - 1)]]
    columns = {
        "valid_time": data.index.strftime("%Y-%m-%d %H:%M:%S"),
        "ssrd": 3600 * rolled["ghi"].to_numpy(),
    }
    columns |= {
        "fdir": 3600 * (rolled["ghi"] - rolled["dhi"]).to_numpy(),
        "t2m": rolled["temp_air"].to_numpy() + 273.15,
    }
    columns |= {
        "u10": 0.6 * rolled["wind_speed"].to_numpy(),
        "v10": 0.8 * rolled["wind_speed"].to_numpy(),
        "sp": 1e5,
    }
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        table = pd.DataFrame(columns).assign(latitude=52.5, longitude=13.5)
        archive.writestr("reanalysis.csv", table.to_csv(index=False))
    return packed.getvalue()


ANSWERS = {
    "seriescalc": answer_pvgis,
    "power": answer_power,
    "archive": answer_open_meteo,
    "file.zip": answer_era5,
}


class Handler(BaseHTTPRequestHandler):
    """Answers as the services do; `server.change` may change a year, `server.refuse` is (status,
    body).
    """

    def do_GET(self):
        self.answer()

    def do_POST(self):
        self.body = self.rfile.read(int(self.headers["Content-Length"]))
        self.answer()

    def answer(self):
        server, path = self.server, urlsplit(self.path)
        server.asked.append(self.path)
        time.sleep(server.wait)
        base = f"http://127.0.0.1:{server.server_port}"
        status, body = 200, b""
        if server.refuse:
            status, body = server.refuse
        elif path.path.endswith("/printhorizon"):
            body = server.horizon
        elif path.path.endswith("/execution"):
            server.sent = {"body": json.loads(self.body), "key": self.headers["PRIVATE-TOKEN"]}
            body = {"jobID": "7", "status": "accepted", "metadata": {}}
        elif path.path.endswith("/jobs/7"):
            body = {"status": "successful"}
        elif path.path.endswith("/jobs/7/results"):
            body = {"asset": {"value": {"href": f"{base}/file.zip"}}}
        else:
            body = server.edit(ANSWERS[path.path.rsplit("/", 1)[1]](server.change(year())))
        self.send_response(status)
        self.end_headers()
        self.wfile.write(body if isinstance(body, bytes) else json.dumps(body).encode())

    def log_message(self, *_):
        pass


class Server(ThreadingHTTPServer):
    """One whose client may be gone before it answers."""

    def handle_error(self, request, client_address):
        if not isinstance(sys.exc_info()[1], BrokenPipeError | ConnectionResetError):
            super().handle_error(request, client_address)


@contextmanager
def open_server():
    """A server with its settings, which is closed at the end."""
    with Server(("127.0.0.1", 0), Handler) as server:
        server.asked, server.wait, server.refuse, server.sent = [], 0, None, None
        server.change = server.edit = lambda data: data
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server
        server.shutdown()


def point_at(monkeypatch, tmp_path, base):
    """Ask another server instead of each service."""
    monkeypatch.setattr(pvlib.iotools.pvgis, "URL", f"{base}/api/")
    monkeypatch.setattr(pvlib.iotools.nasa_power, "URL", f"{base}/power")
    monkeypatch.setattr(ask_services, "OPEN_METEO_URL", f"{base}/v1/archive")
    (tmp_path / "cdsapirc").write_text(f"url: {base}\nkey: a-key-of-one's-own\n")
    monkeypatch.setenv("CDSAPI_RC", str(tmp_path / "cdsapirc"))
    monkeypatch.delenv("CDSAPI_URL", raising=False)
    monkeypatch.delenv("CDSAPI_KEY", raising=False)
