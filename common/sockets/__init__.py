"""Control and view sockets of both processes, over ZeroMQ.

The control sockets (ROUTER and DEALER) carry small messages both ways. The view sockets (PUB and SUB) carry pictures
and telemetry to the operator; they are separate so that a picture never delays a stiffness. No call but `wait` blocks.
A message that cannot leave now is dropped and counted, because a newer one follows. All sockets of a side are used by
one thread.

`round_robin` rotates messages over several connections of one peer; `peers` assigns connections to peers. These
two do not use ZeroMQ, nor do `keys`, `allow_list`, `endpoints`, `port_connections`, `descriptors` and `admission`.
"""
