"""The answer of a diagnosis as one screen: a sentence, why, what it buys, where it failed, what else it could be.

All of it is read from the JSON document, so the studio, reports, notebooks and the terminal cannot say different things.
"""

from orchestrator.report.answer.answer import Answer, answer_of

__all__ = ["Answer", "answer_of"]
