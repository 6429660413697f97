// What perceives objects, in C++17 with libzmq alone: a table and a ball, 30 frames a second.
//   g++ -std=c++17 -o example_objects example_objects.cpp -lzmq && ./example_objects tcp://127.0.0.1:5602
#include <zmq.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <thread>

// MessagePack by hand: maps and lists of up to 15 entries, names of up to 31 bytes, whole numbers, floats.
struct Packed {
    std::string bytes;
    void map(int entries) { bytes += char(0x80 | entries); }
    void list(int entries) { bytes += char(0x90 | entries); }
    void text(const std::string &words) { bytes += char(0xa0 | words.size()), bytes += words; }
    void yes() { bytes += char(0xc3); }
    void big_endian(char mark, uint64_t bits) {
        bytes += mark;
        for (int shift = 56; shift >= 0; shift -= 8) bytes += char(bits >> shift & 0xff);
    }
    void whole(uint64_t value) { big_endian(char(0xcf), value); }
    void number(double value) {
        uint64_t bits;
        std::memcpy(&bits, &value, sizeof bits);
        big_endian(char(0xcb), bits);
    }
    void three(double x, double y, double z) { list(3), number(x), number(y), number(z); }
};

int main(int count, char **words) {
    void *socket = zmq_socket(zmq_ctx_new(), ZMQ_DEALER);
    int most = 2;
    zmq_setsockopt(socket, ZMQ_SNDHWM, &most, sizeof most);
    if (zmq_connect(socket, count > 1 ? words[1] : "tcp://127.0.0.1:5602")) return std::perror("connect"), 2;
    for (uint64_t sequence = 1;; ++sequence) {
        const auto since = std::chrono::steady_clock::now().time_since_epoch();
        const double now_s = std::chrono::duration<double>(since).count();
        Packed frame;
        frame.map(5);
        frame.text("version"), frame.whole(1);
        frame.text("sequence"), frame.whole(sequence);
        frame.text("sent_s"), frame.number(now_s);
        frame.text("taken_s"), frame.number(now_s);
        frame.text("objects"), frame.list(2);
        frame.map(2), frame.text("name"), frame.text("table"), frame.text("half_space"), frame.yes();
        frame.map(3), frame.text("name"), frame.text("target"), frame.text("sphere"), frame.number(0.03);
        frame.text("position_m"), frame.three(0.6, 0.0, 0.2);
        zmq_send(socket, frame.bytes.data(), frame.bytes.size(), ZMQ_DONTWAIT);
        char said[512];
        for (int bytes; (bytes = zmq_recv(socket, said, sizeof said, ZMQ_DONTWAIT)) > 0;)
            std::printf("refused: %.*s\n", bytes < 512 ? bytes : 512, said), std::fflush(stdout);
        std::this_thread::sleep_for(std::chrono::milliseconds(33));
    }
}
