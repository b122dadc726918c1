from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str
COLUMN_DTYPE: np.dtype[np.void]
POINT_DTYPE: np.dtype[np.void]
TRACKLET_DTYPE: np.dtype[np.void]
OBJECT_DTYPE: np.dtype[np.void]
FLOW_DTYPE: np.dtype[np.void]

Profile = Literal["hdl64", "wide", "far", "dissertation"]
Settings = Mapping[str, float | bool | str]

class Rig:
    def __new__(
        cls,
        sensors: Sequence[ArrayLike] | None = None,
        *,
        timing: Literal["stamp", "offset", "azimuth"] = "stamp",
        start: float = 0.0,
        span: float = 0.1,
        distorted: bool = False,
        ground: float = -1.73,
        own_vehicle: tuple[float, float, float, float] | None = None,
    ) -> Rig: ...
    @property
    def ground(self) -> float: ...

class Pipeline:
    def __new__(
        cls,
        profile: Profile = "hdl64",
        rig: Rig | None = None,
        *,
        settings: Settings | None = None,
        find_poses: bool = False,
        objects: bool = False,
        points_max: int = 0,
        threads: int = 0,
    ) -> Pipeline: ...
    def step(
        self,
        points: ArrayLike | Sweep,
        stamp: float | None = None,
        pose: ArrayLike | None = None,
        *,
        twist: ArrayLike | None = None,
        time: ArrayLike | None = None,
        sensor: ArrayLike | None = None,
    ) -> Step: ...
    def update_digest(self) -> str: ...
    @property
    def threads(self) -> int: ...
    @property
    def memory(self) -> int: ...

class Step:
    @property
    def columns(self) -> NDArray[np.void]: ...
    @property
    def points(self) -> NDArray[np.void]: ...
    @property
    def tracklets(self) -> NDArray[np.void]: ...
    @property
    def objects(self) -> NDArray[np.void]: ...
    @property
    def dt(self) -> float | None: ...
    @property
    def reset(self) -> Literal["first", "backwards", "gap", "jump", "spin"] | None: ...
    @property
    def pose(self) -> NDArray[np.float64]: ...
    @property
    def located(self) -> Literal["start", "registered", "degenerate", "lost"] | None: ...
    @property
    def dropped(self) -> dict[str, int]: ...

class Recording:
    def __new__(
        cls,
        path: str | PathLike[str],
        *,
        poses: str | PathLike[str] | None = None,
        topics: Sequence[str] | None = None,
        ground: float | None = None,
    ) -> Recording: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: int) -> Sweep: ...
    def __iter__(self) -> Iterator[Sweep]: ...
    @property
    def rig(self) -> Rig: ...
    @property
    def located(self) -> bool: ...

class Sweep:
    @property
    def points(self) -> NDArray[np.float32]: ...
    @property
    def intensity(self) -> NDArray[np.float32]: ...
    @property
    def time(self) -> NDArray[np.float32]: ...
    @property
    def sensor(self) -> NDArray[np.uint32]: ...
    @property
    def stamp(self) -> float: ...
    @property
    def frame(self) -> int: ...
    @property
    def pose(self) -> NDArray[np.float64] | None: ...
    @property
    def twist(self) -> NDArray[np.float64]: ...
    def __len__(self) -> int: ...

class CloudFlow:
    @property
    def points(self) -> NDArray[np.void]: ...
    @property
    def pose(self) -> NDArray[np.float64]: ...
    @property
    def ground(self) -> float: ...

def flow(
    a: ArrayLike,
    b: ArrayLike,
    *,
    dt: float = 0.1,
    profile: Profile = "hdl64",
    settings: Settings | None = None,
    ground: float | None = None,
    sensor: tuple[float, float, float] | None = None,
    pose: ArrayLike | None = None,
) -> CloudFlow: ...
def odometry(path: str | PathLike[str]) -> NDArray[np.float64]: ...
def main(args: list[str]) -> int: ...
