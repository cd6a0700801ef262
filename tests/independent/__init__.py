"""A second simulator of the rigs, for tests only.

It shares no line and no numerical choice with the package: fixed steps of a few microseconds instead of located
switches, friction as a projection of the velocity, sensors filtered on the fine grid. It needs numpy, scipy and numba.
"""
