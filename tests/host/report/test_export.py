"""Exports, each opened by a reader that is not ours; damaged logs export what is proven."""

import json
import zipfile
from pathlib import Path
from xml.etree import ElementTree as Xml

import fastkml
import gpxpy
import numpy as np
import pytest
from host.cli import main
from host.report.shown_flight import ShownFlight
from lxml import etree
from mcap.reader import make_reader
from pymavlink import mavutil
from pyulog import ULog

from tests.host.report.flights import DOUBLETS_S, NAME


@pytest.fixture(scope="module")
def folder(log_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with every export of the log of a lost second and hostile names."""
    place = tmp_path_factory.mktemp("exports")
    kinds = [
        word for kind in ("tlog", "ulog", "kml", "kmz", "gpx", "mcap") for word in ("--to", kind)
    ]
    assert main(["export", str(log_file), *kinds, "-o", str(place)]) == 3
    return place


def exported(folder: Path, ending: str) -> Path:
    """Return the file of a format."""
    return folder / f"{Path(NAME).stem}{ending}"


def rows_of(flight: ShownFlight, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return time and values of a column where it was measured."""
    known = np.isfinite(flight.columns[name])
    return flight.t_s[known], flight.columns[name][known]


def test_pyulog_reads_every_row_events_and_calibration(folder: Path, flight: ShownFlight) -> None:
    log = ULog(str(exported(folder, ".ulg")))
    assert not log.file_corruption
    (table,) = [one for one in log.data_list if one.name == "flight_test"]
    t_s, q = rows_of(flight, "q_radps")
    read = table.data["q_radps"]
    assert np.allclose(read[np.isfinite(read)], q, atol=1e-6)
    assert np.allclose(table.data["t_s"][np.isfinite(read)], t_s)
    assert np.max(np.diff(table.data["timestamp"].astype(float))) > 0.9e6  # the second that is lost
    assert any("mark: 7" in one.message for one in log.logged_messages)
    assert "CAL_channel.alpha_a.slope" in log.initial_parameters
    assert "format" in log.msg_info_dict["calibration"]
    assert {"sensor_combined", "vehicle_attitude", "vehicle_gps_position"} <= {
        one.name for one in log.data_list
    }


def test_pymavlink_reads_attitude_flow_angles_and_words(folder: Path, flight: ShownFlight) -> None:
    link = mavutil.mavlink_connection(str(exported(folder, ".tlog")), dialect="ardupilotmega")
    found: dict[str, list[object]] = {}
    while (message := link.recv_match()) is not None:
        found.setdefault(message.get_type(), []).append(message)
    link.close()
    assert "BAD_DATA" not in found
    turned = found["ATTITUDE"]
    assert len(turned) == pytest.approx(39.0 * 25.0, rel=0.03)  # a second is lost
    first = min(0.0, *(one.t_s for one in flight.events))
    at = [one.time_boot_ms / 1e3 + first for one in turned]  # type: ignore[attr-defined]
    want = np.interp(at, *rows_of(flight, "theta_rad"))
    assert np.allclose([one.pitch for one in turned], want, atol=2e-3)  # type: ignore[attr-defined]
    texts = [one.text for one in found["STATUSTEXT"]]  # type: ignore[attr-defined]
    assert "mark: 7" in texts and any(text.startswith("lost:") for text in texts)
    assert len(found["PARAM_VALUE"]) == len(flight.calibration)
    assert {"AOA_SSA", "SERVO_OUTPUT_RAW", "RC_CHANNELS", "GLOBAL_POSITION_INT"} <= found.keys()


def test_kml_fits_its_schema_and_names_test_points(folder: Path, flight: ShownFlight) -> None:
    schema = Path(fastkml.__file__).parent / "schema/kml22gx.xsd"
    tree = etree.parse(str(exported(folder, ".kml")))
    etree.XMLSchema(etree.parse(str(schema))).assertValid(tree)
    space = {"k": "http://www.opengis.net/kml/2.2", "gx": "http://www.google.com/kml/ext/2.2"}
    assert len(tree.findall(".//gx:coord", space)) == len(flight.position["t_s"])
    assert len(tree.findall(".//gx:coord", space)) == len(tree.findall(".//gx:Track/k:when", space))
    lines = tree.findall(".//k:LineString", space)
    assert len(lines) == len(DOUBLETS_S)
    names = [one.text for one in tree.findall(".//k:name", space)]
    assert "1: elevator doublet" in names and r"\x01" in str(names[0])
    with zipfile.ZipFile(exported(folder, ".kmz")) as archive:
        assert archive.read("doc.kml") == exported(folder, ".kml").read_bytes()


def test_gpxpy_reads_segments_between_gaps(folder: Path, flight: ShownFlight) -> None:
    read = gpxpy.parse(exported(folder, ".gpx").read_text(encoding="utf-8"))
    whole = read.tracks[0]
    points = [point for segment in whole.segments for point in segment.points]
    assert np.allclose([p.latitude for p in points], flight.position["latitude_deg"], atol=1e-7)
    steps = np.diff([p.time.timestamp() for p in points if p.time])
    assert steps.min() > 0.0 and len(read.tracks) == 1 + len(DOUBLETS_S)
    assert any("mark: 7" in str(one.name) for one in read.waypoints)


def test_mcap_reader_reads_rows_events_and_attachments(folder: Path, flight: ShownFlight) -> None:
    with exported(folder, ".mcap").open("rb") as file:
        reader = make_reader(file)
        rows = [json.loads(m.data) for _, c, m in reader.iter_messages() if c.topic == "/flight"]
        said = [json.loads(m.data)["text"] for _, c, m in reader.iter_messages(topics=["/events"])]
        files = {one.name for one in reader.iter_attachments()}
        notes = {one.name: one.metadata for one in reader.iter_metadata()}
        summary = reader.get_summary()
        assert summary is not None
        (schema,) = [s for s in summary.schemas.values() if s.name == "row"]
    _, q = rows_of(flight, "q_radps")
    assert np.allclose([r["q_radps"] for r in rows if r["q_radps"] is not None], q, rtol=1e-6)
    assert json.loads(schema.data)["properties"]["q_radps"]["description"].startswith("rad/s")
    assert "mark: 7" in said and files == {"calibration.toml", "decode.txt"}
    assert notes["flight"]["losses"] == "1"


def test_layouts_name_curves_that_are_in_the_files(folder: Path) -> None:
    log = ULog(str(exported(folder, ".ulg")))
    known = {f"{one.name}/{name}" for one in log.data_list for name in one.data}
    layout = Xml.parse(folder / f"{Path(NAME).stem}.ulog.plotjuggler.xml")
    curves = {one.get("name") for one in layout.iter("curve")}
    assert len(curves) > 8 and curves <= known


def test_what_cannot_be_exported_is_one_line(
    log_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["export", str(log_file), "--to", "gpx"]
    for more, said in (
        (["-o", str(tmp_path / "a.kml")], "a name of --to gpx ends in .gpx"),
        (["--rate", "5"], "of --to tlog only"),
        (["--row-rate", "5"], "has no --row-rate"),
    ):
        assert main([*words, *more]) == 2
        err = capsys.readouterr().err
        assert said in err and err.count("\n") == 1
