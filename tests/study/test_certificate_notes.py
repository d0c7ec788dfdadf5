"""A certificate names flags that the verb that it names has."""

from __future__ import annotations

import re

from pneumorph.base.layers import flags_of
from pneumorph.environment.goal import Goal
from pneumorph.study.certificate_notes import pair_notes
from pneumorph.study.certified_candidates import CertificateSettings


def test_walks_of_finite_elements_are_asked_for_of_the_verb_that_makes_them() -> None:
    """`coopt` ends with a certificate as well, and has no such flag."""
    (note,) = pair_notes((), Goal())
    verb, flag = re.findall(r"`pneumorph (\w+) RUN (--\S+)`", note)[0]
    assert verb == "certify"
    assert flag in flags_of(CertificateSettings)
