"""placeholder"""


def shortest_order(ends, rows, backward, passage, *, radius_m, start):
    return rows, backward
