"""A control and a view socket for each of the two processes, over ZeroMQ.

Control (ROUTER and DEALER) carries small messages both ways, view (PUB and SUB) frames and telemetry to
the operator, apart so that a frame never delays a stiffness. No call but `wait` blocks; a message that cannot
leave now is dropped and counted, because a newer one follows. A shell belongs to one thread.

`turns` says how messages take turns over several connections of one peer, and `peers` whose connections are whose.
Neither knows ZeroMQ, nor do `keys`, `allow_list`, `endpoints`, `crowd`, `descriptors` and `admission`.
"""
