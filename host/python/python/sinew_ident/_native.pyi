"""Types of the native half."""

from collections.abc import Callable

__version__: str

_Column = tuple[str, bytes]
_Recording = tuple[str, bytes, list[_Column]]
_Run = tuple[str, int, bytes, list[tuple[str, str, bytes, bytes]]]
_Progress = Callable[[str, int, int], object] | None

class NativeRig:
    @staticmethod
    def load(path: str) -> NativeRig: ...
    @staticmethod
    def parse(text: str, file: str) -> NativeRig: ...
    @staticmethod
    def of_mechanism(
        path: str, format: str, joints: list[str]
    ) -> tuple[NativeRig, list[str], list[str]]: ...
    @property
    def name(self) -> str: ...
    @property
    def file(self) -> str: ...
    def to_toml(self) -> str: ...
    def to_mjcf(self) -> tuple[str, list[str]]: ...
    def parameters(self) -> list[tuple[str, float, str, bool]]: ...
    def inputs(self) -> list[tuple[str, str, tuple[float, float] | None]]: ...
    def sensors(self) -> list[tuple[str, str, str]]: ...
    def effects(self) -> list[tuple[str, str]]: ...

def fit(
    rig: NativeRig, fit: list[_Recording], test: list[_Recording], progress: _Progress
) -> tuple[str, NativeRig, list[tuple[str, _Run, _Run]]]: ...
def check(of: list[_Recording], rig: NativeRig | None) -> str: ...
def diagnose(
    rig: NativeRig,
    fit: list[_Recording],
    check: list[_Recording],
    test: list[_Recording],
    seed: int,
    time_limit: float | None,
    progress: _Progress,
) -> tuple[str, str, str, NativeRig, NativeRig, list[tuple[str, _Run, _Run]]]: ...
def simulate(rig: NativeRig, recording: _Recording) -> list[_Column]: ...
def excite(
    rig: NativeRig,
    kind: str,
    seconds: float,
    rate: float,
    seed: int,
    amplitude: float,
    band: list[float] | None,
) -> tuple[bytes, list[_Column]]: ...
