import zmq

from common.sockets.gate import Gate


def test_a_connection_after_the_gates_closing_is_served() -> None:
    with zmq.Context() as context, context.socket(zmq.REP) as server, context.socket(zmq.REQ) as client:
        gate = Gate(context, server, most=4, introduced_s=1.0, unsent_bytes=1024, bytes_per_s=1e6)
        server.bind("tcp://127.0.0.1:0")
        gate.close()
        client.linger = 0
        client.connect(server.getsockopt_string(zmq.LAST_ENDPOINT))
        client.send(b"question")
        assert server.poll(60_000)
        assert server.recv() == b"question"
