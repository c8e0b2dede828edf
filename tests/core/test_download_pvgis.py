"""Typical years from PVGIS' server: a local one that sends what the real one sent, one that refuses, and none."""

import gzip
import threading
import time
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import ClassVar

import numpy as np
import pvlib
import pytest
from small_city import write_small_city
from weathers import DATA, PVGIS

from citypv.core.commands.command_line import main
from citypv.core.settings.errors import InputError
from citypv.core.weather.read_weather import read_weather

ANSWER = gzip.decompress((DATA / "pvgis_tmy_45.000_8.000_2005_2023.json.gz").read_bytes())
REFUSAL = b'{"message": "Location over the sea. Please, select another location", "status": 400}'


class Server(BaseHTTPRequestHandler):
    asked: ClassVar[list] = []

    def do_GET(self):
        self.asked.append(self.path)
        known = "lat=45" in self.path
        self.send_response(200 if known else 400)
        self.end_headers()
        self.wfile.write({True: ANSWER, False: REFUSAL}[known] if "lat=9" not in self.path else b"<html>")

    def log_message(self, *_):
        pass


@pytest.fixture
def server(monkeypatch):
    with HTTPServer(("127.0.0.1", 0), Server) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        monkeypatch.setattr(pvlib.iotools.pvgis, "URL", f"http://127.0.0.1:{server.server_port}/api/")
        Server.asked.clear()
        yield
        server.shutdown()
        thread.join()


def test_downloaded_is_as_read_from_a_file(server):
    downloaded, read = read_weather("pvgis", 45.0, 368.0), read_weather(PVGIS, 45.0, 8.0)
    assert Server.asked == ["/api/tmy?lat=45.0&lon=8.0&outputformat=json"]
    assert (downloaded.latitude, downloaded.longitude, downloaded.altitude) == (45.0, 8.0, 250.0)
    assert downloaded.data.index[0] == read.data.index[0]
    np.testing.assert_allclose(downloaded.data["ghi"], read.data["ghi"], atol=0.01)
    assert "PVGIS" in downloaded.label and "downloaded" in downloaded.label


def test_refusal_is_told_in_the_servers_words(server):
    with pytest.raises(InputError, match=r"Location over the sea.*climate") as caught:
        read_weather("pvgis", 0.0, -30.0)
    assert "\n" not in str(caught.value)


def test_an_answer_that_is_no_typical_year(server):
    with pytest.raises(InputError, match="pvgis"):
        read_weather("pvgis", 9.0, 8.0)


def test_without_a_network_it_ends_at_once(tmp_path, monkeypatch, capfd):
    # Port 9 of this machine: nobody answers.
    monkeypatch.setattr(pvlib.iotools.pvgis, "URL", "http://127.0.0.1:9/api/")
    city, start = write_small_city(tmp_path / "small.gml"), time.monotonic()
    out = tmp_path / "out"
    assert main(["simulate", str(city), "--weather", "pvgis", "--out", str(out), "--quiet"]) == 2
    assert time.monotonic() - start < 10
    said = capfd.readouterr().err
    assert said.count("\n") == 1 and "cannot reach http://127.0.0.1:9/api/" in said and "--weather climate" in said
    assert not out.exists()
