"""What the exercises check: each function takes a student's function, tries it, and answers in one or two sentences.

A check does not crash, hang or show a traceback because of what a student wrote, and recognises the usual mistakes by name. It
returns a ``Verdict``, which is true if the answer is right. ``more`` asks for that many further inputs, drawn with a fixed seed.
"""

from stairlab.checks._judge import Verdict

__all__ = ["Verdict"]
