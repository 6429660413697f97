"""A control and a view socket for each of the two processes, over ZeroMQ.

Control (ROUTER and DEALER) carries small messages both ways, view (PUB and SUB) frames and telemetry to
the operator, apart so that a frame never delays a stiffness. No call but `wait` blocks; a message that cannot
leave now is dropped and counted, because a newer one follows. A shell belongs to one thread.

Only `shell`, `authentication`, `robot` and `operator` know ZeroMQ: what both ends share, who may connect, and the
two ends. `keys`, `allow_list`, `endpoints`, `crowd` and `admission` are what they go by.
"""
