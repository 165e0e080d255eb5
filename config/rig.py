"""A rig: which plant, which perception, which arm file. Implementations are named as import strings."""

from typing import Annotated

from msgspec import Meta

from config.perturbation import Perturbation
from config.values import Angle, Name, Section

__all__ = ["DEFAULT_LIMITS", "NodeStart", "PlantExpected", "Rig", "RigCamera"]

DEFAULT_LIMITS = "ur5e_parallel_jaw_85"

ImportString = Annotated[str, Meta(pattern=r"^[a-z_][a-z0-9_.]*:[A-Za-z_][A-Za-z0-9_]*\Z")]


class PlantExpected(Section, frozen=True, kw_only=True):
    """What the plant must say it is before anything is armed."""

    kind: Annotated[str, Meta(pattern=r"^(real|virtual|twin|fake)\Z")]
    model: str
    serial: str


class RigCamera(Section, frozen=True, kw_only=True):
    """One camera of a rig, and what is known of it. Files are shipped names or paths, from the rig's file on."""

    name: Name
    """Which of the plant's cameras."""
    calibration: Annotated[str, Meta(min_length=1, max_length=500)]
    """Its lens and place, as `autotelic calibrate` wrote them."""
    colours: Annotated[str, Meta(min_length=1, max_length=500)]
    """How the scenario's things look through it, as `autotelic perception learn` wrote it."""
    source: ImportString | None = None
    """What gives its frames, where it has a process of its own (`autotelic node camera`)."""
    device: Annotated[str, Meta(max_length=500)] = ""
    """Which one of these, in that source's words: `/dev/video0`, or a video file from the rig's file on."""
    rate_hz: Annotated[float, Meta(ge=1.0, le=240.0)] = 20.0
    """How many frames a second are asked of it."""
    exposure: Annotated[float, Meta(ge=0.0, le=1e6)] | None = None
    """What a driver's exposure is locked at, in that driver's own unit (100 µs on Linux); None: by itself."""
    recorded: Annotated[str, Meta(pattern=r"^(jpeg|png|none)\Z")] = "jpeg"
    """How its frames are kept in sessions; PNG keeps each pixel, at some ten times the size."""
    recorded_quality: Annotated[int, Meta(ge=1, le=100)] = 85
    """Of a JPEG."""


class NodeStart(Section, frozen=True, kw_only=True):
    """One process of a rig, as `autotelic up` starts it."""

    name: Annotated[str, Meta(pattern=r"^[a-z][a-z0-9_]{0,15}\Z")]
    """Its source on the bus."""
    kind: Annotated[str, Meta(pattern=r"^(hub|robot|perception|camera|job|other)\Z")] = "other"
    """The bus's hub, what holds the arm, what perceives for that, what it looks through, what commands the arm and
    whose end is the end of all, or what the arm can do without: that is started again while the arm goes on."""
    command: Annotated[tuple[str, ...], Meta(min_length=1)]
    """Words of an `autotelic` command; {rig}, {scenario}, {address}, {bus}, {keys}, {cell} and {out} are filled in."""
    is_by_hand: bool = False
    """A person starts it, in a terminal of its own: it asks things there. `autotelic up` says which command that is."""


class Rig(Section, frozen=True, kw_only=True):
    """The same processes, one way of three."""

    name: Name
    description: str = ""
    arm: str
    """A shipped arm's name or a path to a file."""
    limits: str = DEFAULT_LIMITS
    """A shipped limits file's name or a path to one; it must be for this arm and its tool."""
    profile: Name = "unattended"
    """Which of its profiles is held."""
    plant: ImportString
    perception: ImportString | None = None
    """What makes percepts; without one nothing can be learnt here, and the arm is not connected to."""
    camera: "RigCamera | None" = None
    """What a perception by camera looks through."""
    operator: ImportString | None = None
    """Who arms the station where no hardware is attached; refused by a real arm."""
    view: ImportString | None = None
    """What shows arm and table to somebody who drives."""
    shadow: ImportString | None = None
    """What a driver's intents may be tried on before they are sent."""
    cell: str | None = None
    """A shipped cell's name or a path: where the control box has the table's signals. Straight through where absent."""
    reset: Annotated[str, Meta(pattern=r"^(twin|person)\Z")] = "twin"
    """Who lays the table out: the twin's process, or a person whom the arm waits for."""
    parked_rad: tuple[Angle, Angle, Angle, Angle, Angle, Angle] | None = None
    """Where the arm waits while a person lays the table out, out of the camera's sight; its home where None."""
    address: Annotated[str, Meta(pattern=r"^[A-Za-z0-9._:-]{1,253}\Z")] | None = None
    """Host or IP address of the arm's controller, where it has one."""
    bus: Annotated[str, Meta(pattern=r"^(tcp|tls|unixsock-stream)/[A-Za-z0-9._:/-]{1,200}\Z")] | None = None
    """Zenoh endpoint where the twin's process listens; with it the arm is held by a servo process of its own."""
    keys: Annotated[str, Meta(min_length=1, max_length=500)] | None = None
    """Folder of certificates (`autotelic keys`) for a bus at tls/HOST:PORT, from the rig's file on."""
    safeguard_input: Annotated[int, Meta(ge=0, le=7)] | None = None
    """Configurable input of the controller to which a scanner, mat or door is wired as safeguard stop; nobody checks
    the wire. Without one a real arm does not run unattended."""
    nodes: tuple[NodeStart, ...] = ()
    """What `autotelic up` starts, in this order."""
    expected: PlantExpected
    perturbation: Perturbation | None = None
    """How its plant differs from the files, where that is tried; a twin alone does."""
    tick_s: Annotated[float, Meta(ge=0.002, le=0.05)] = 0.01
    physics_s: Annotated[float, Meta(ge=0.0005, le=0.01)] = 0.002
    realtime_priority: Annotated[int, Meta(ge=0, le=90)] = 0
    """SCHED_FIFO priority that a servo process of its own asks for; 0 takes its share of time as all do."""
    recorded_ticks: Annotated[str, Meta(pattern=r"^(whole|around_stops)\Z")] = "whole"
    """Which ticks of an arm on a wire go into sessions: every one, or 50 a second and every one around a stop."""
    max_latches: Annotated[int, Meta(ge=0, le=10_000)] = 20
    """More latches than this within latch_window resets and a run fails: something is wrong that no reset mends."""
    latch_window: Annotated[int, Meta(ge=1, le=100_000)] = 200
