"""What becomes of an arm under way when the processes that move it die, freeze or lie: on the twin's own joints."""

from sim_twin.processes.cases import CASES, Case
from sim_twin.processes.course import ProcessCourse
from sim_twin.processes.judge import Ramp, judge_ramp
from sim_twin.processes.outcome import Outcome

__all__ = ["CASES", "Case", "Outcome", "ProcessCourse", "Ramp", "judge_ramp"]
