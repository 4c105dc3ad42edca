"""Motions of the axes within limits: point to point, stretched in time, to a pose of the tip, to rest."""
