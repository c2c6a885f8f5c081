"""A robot that is not there: it speaks Barrett's protocol as a Proficio does, and moves as a model says."""
