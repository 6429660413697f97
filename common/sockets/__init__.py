"""Control and view sockets of both processes, over ZeroMQ.

Control (ROUTER and DEALER) carries small messages both ways. View (PUB and SUB) carries frames and telemetry to
the operator, apart so that a frame never delays a stiffness. No call but `wait` blocks. A message that cannot
leave now is dropped and counted, because a newer one follows. A shell belongs to one thread.

`turns` rotates messages over several connections of one peer; `peers` assigns connections to peers.
Neither knows ZeroMQ, nor do `keys`, `allow_list`, `endpoints`, `port_connections`, `descriptors` and `admission`.
"""
