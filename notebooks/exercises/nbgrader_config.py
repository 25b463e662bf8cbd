"""nbgrader's settings for this course: run its commands in this folder."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

from generate import PREPROCESSORS  # noqa: E402

c = get_config()  # noqa: F821
c.CourseDirectory.course_id = "stairlab"
c.CourseDirectory.root = str(HERE)
c.GenerateAssignment.preprocessors = PREPROCESSORS
c.ExecutePreprocessor.timeout = 300
