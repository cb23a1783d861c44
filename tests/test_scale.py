"""A survey added up by the workers of a Dask cluster: the same bits, whatever becomes of them."""

from __future__ import annotations

import json
import os
import signal
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from click.testing import CliRunner

import divespot.io.las_stretches
import divespot.one_pass
import divespot.scale.cluster
import divespot.streaming
import divespot.too_large
from divespot import DivespotError, measure, scale
from divespot.cli import main
from test_streaming import CONES, bits, volume_m3, write_las, yard

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from divespot.io.las_stretches import Stretch

distributed = pytest.importorskip("distributed", reason="needs the extra dask")

pytestmark = pytest.mark.filterwarnings("ignore")  # of asyncio and of what it opens


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs=50
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def tiles(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return the tiles of a yard: 300,000 points, cut across along x."""
    folder = tmp_path_factory.mktemp("tiles")
    points = yard(300_000)
    cut = np.digitize(points[:, 0], [9.0, 18.0, 27.0])
    return [write_las(folder / f"{n}.laz", points[cut == n]) for n in range(4)]


@pytest.fixture(autouse=True)
def many_tasks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(divespot.too_large, "MOST_HELD", 100_000)
    monkeypatch.setattr(divespot.streaming, "AIMED_VOXELS", 30_000)
    monkeypatch.setattr(divespot.io.las_stretches, "STRETCH", 25_000)
    monkeypatch.setattr(divespot.scale.cluster, "TASK_POINTS", 25_000)


def test_two_workers_and_a_killed_one_change_no_bit(client: Any, tiles: list[Path]) -> None:  # noqa: ANN401
    expected = bits(measure(tiles))
    assert bits(scale.measure(tiles, client)) == expected
    killed: list[int] = []

    def kill(stage: str) -> None:
        if stage.startswith("read, 3 of") and not killed:
            pids = client.run(os.getpid)
            killed.append(min(pids.values()))
            os.kill(killed[0], signal.SIGKILL)

    assert bits(scale.measure(tiles, client, on_stage=kill)) == expected
    assert killed
    client.wait_for_workers(2)


def test_a_damaged_tile_is_one_line_and_the_rest_is_measured_if_asked(
    client: Any,  # noqa: ANN401
    tiles: list[Path],
    tmp_path: Path,
) -> None:
    data = tiles[3].read_bytes()
    broken = tmp_path / "broken.laz"
    broken.write_bytes(data[: len(data) // 2])
    paths = [*tiles[:3], broken]
    with pytest.raises(DivespotError, match=r"broken\.laz: .*truncated") as caught:
        scale.measure(paths, client)
    assert "\n" not in str(caught.value)
    report = scale.measure(paths, client, skip_damaged=True)
    assert [told for told in report.warnings if "broken.laz" in told] == [str(caught.value)]
    assert report.piles[0].volume_m3 == pytest.approx(volume_m3(*CONES[0][:2]), rel=0.01)
    with pytest.raises(DivespotError, match=r"broken\.laz"):
        scale.measure(broken, client, skip_damaged=True)


def test_points_that_cannot_be_decoded_are_counted(
    tiles: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    records_of = divespot.io.las_stretches.records_of

    plan = divespot.streaming.planned(list(map(str, tiles)), divespot.Settings(), skip_damaged=True)
    scratched = next(stretch for stretch in plan.stretches if stretch.path == str(tiles[1]))

    def fails(stretch: Stretch) -> NDArray[np.uint8]:
        if stretch == scratched:
            raise DivespotError(f"{stretch.path}: scratched")
        return records_of(stretch)

    monkeypatch.setattr(divespot.one_pass, "records_of", fails)
    part = divespot.streaming.read(plan, 2)
    assert part.lost() == (f"{tiles[1]}: scratched: {scratched.count} of its points were left out",)
    assert part.counts[0] == 300_000 - scratched.count


def test_what_is_no_survey_is_refused(client: Any, tmp_path: Path) -> None:  # noqa: ANN401
    with pytest.raises(DivespotError, match=r"missing\.laz: cannot be read"):
        scale.measure(tmp_path / "missing.laz", client)
    (tmp_path / "scan.xyz").write_text("0 0 0\n")
    with pytest.raises(DivespotError, match=r"scan\.xyz: it is no LAS or LAZ file"):
        scale.measure(tmp_path / "scan.xyz", client)
    with pytest.raises(DivespotError, match="a Dask scheduler is needed"):
        divespot.scale.cluster.connected("tcp://127.0.0.1:1", timeout_s=0.5)


def test_the_command_line_takes_the_address_of_a_scheduler(client: Any, tiles: list[Path]) -> None:  # noqa: ANN401
    address = client.scheduler.address
    paths = list(map(str, tiles))
    result = CliRunner().invoke(main, ["measure", *paths, "--scheduler", address, "--json", "-"])
    assert result.exit_code == 0, result.stderr
    expected, found = bits(measure(tiles)), json.loads(result.stdout)
    assert found["piles"] == json.loads(json.dumps(expected["piles"]))
    result = CliRunner().invoke(main, ["measure", *paths, "--skip-damaged"])
    assert result.exit_code == 2
    assert "--scheduler is needed with it" in result.stderr
