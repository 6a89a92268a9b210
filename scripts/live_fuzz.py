"""Requests that no good client sends to daylit-run: malformed, slow, never reading, in floods."""
import collections, http.client, json, random, socket, threading, time

HOST = "127.0.0.1"
GETS = ["/", "/style.css", "/main.js", "/api.js", "/scene.js", "/picture.js", "/panels.js", "/room.js", "/three.js", "/status",
        "/metrics", "/healthz", "/readyz", "/scene", "/scene/room", "/scene/light", "/scene/regions", "/scene/sky.jpg",
        "/scene/pick?x=90&y=90", "/scene/pick?x=-1e308&y=nan", "/nothing", "/../../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd",
        "/status?token=%00%ff&x=&=&&", "//scene", "/scene/../scene.toml"]
STREAMS = ["/stream.mjpg", "/events"]
SELDOM_GETS = ["/snapshot.png", "/snapshot.exr"]
BODIES = {"/scene/change": [{"object": 0, "position": [1.5, 2.0, 0.75]}, {"object": 0, "rotation": [0, 0, 40], "scale": 1.1},
                            {"object": 0, "pixel": [90, 100], "grip": [0.01, -0.02]}, {"object": 18446744073709551615, "scale": 1},
                            {"object": 0, "position": [1e308, -1e308, 0]}],
          "/scene/show": [{"direct": True, "indirect": True, "differential": True}, {"direct": "no", "indirect": None}],
          "/scene/remove": [{"object": 7}, {"object": -1}, {}]}
SELDOM_BODIES = {"/scene/add": [{"model": 0, "position": [1.4, 2.2, 0.75]}], "/scene/remove": [{"object": 1}], "/scene/save": [{}]}


def get_request(path):
    return f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode()


def post_request(path, body, token):
    text = body if isinstance(body, bytes) else json.dumps(body).encode()
    return (f"POST {path} HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {token}\r\nContent-Type: application/json\r\n"
            f"Content-Length: {len(text)}\r\n\r\n").encode() + text


def damaged(chance, data):
    """Bytes changed, repeated, left out; lengths and encodings that do not hold."""
    data = bytearray(data)
    for _ in range(chance.randint(1, 6)):
        at = chance.randrange(len(data))
        match chance.randrange(5):
            case 0: data[at] = chance.randrange(256)
            case 1: data[at:at] = data[at:at + 40] * chance.randint(1, 50)
            case 2: del data[at:at + chance.randint(1, 30)]
            case 3: data[at:at] = chance.choice([b"\r\n", b"\0", b"%", b"\xff\xfe", b"9" * 30, b"[" * 300, b"\"", b": "])
            case 4: data = bytearray(bytes(data).replace(b"\r\n\r\n", chance.choice([
                b"\r\nContent-Length: 99999999999999999999\r\n\r\n", b"\r\nContent-Length: -1\r\n\r\n", b"\r\nTransfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\n",
                b"\r\nRange: bytes=0-,0-,0-,-1\r\n\r\n", b"\r\nExpect: 100-continue\r\n\r\n", b"\r\nContent-Type: multipart/form-data; boundary=x\r\n\r\n--x\r\n",
                b"\r\nAccept-Encoding: gzip, br\r\nConnection: keep-alive\r\n\r\n"]), 1))
        if not data:
            return b"\n"
    return bytes(data)


class Attack:
    def __init__(self, port, token, requests, seed=17):
        self.port, self.token, self.requests, self.seed = port, token, requests, seed
        self.sent, self.going, self.lock = 0, True, threading.Lock()
        self.replies, self.wrong = collections.Counter(), []

    def one_request(self, chance):
        seldom = chance.random() < 0.01
        if chance.random() < 0.5:
            request = get_request(chance.choice(SELDOM_GETS if seldom else GETS))
        else:
            path, bodies = chance.choice(list((SELDOM_BODIES if seldom else BODIES).items()))
            body = chance.choice(bodies)
            if chance.random() < 0.4:
                body = damaged(chance, json.dumps(body).encode())
            request = post_request(path, body, chance.choice([self.token] * 9 + ["wrong"]))
        return damaged(chance, request) if chance.random() < 0.4 else request

    def exchange(self, request, whole=True):
        """The status of the answer; 0: closed without one, -1: no connection."""
        try:
            with socket.create_connection((HOST, self.port), timeout=20) as s:
                s.sendall(request)
                if not whole:
                    return None
                s.shutdown(socket.SHUT_WR)
                reply = b""
                while (piece := s.recv(1 << 16)):
                    reply = reply + piece if len(reply) < 64 else reply
        except TimeoutError:
            return "no answer"
        except OSError:
            return "closed"
        if reply and not reply.startswith(b"HTTP/1."):
            self.wrong.append(reply[:80])
        return int(reply[9:12]) if reply[9:12].isdigit() else "closed"

    def worker(self, number):
        chance = random.Random(self.seed * 1000 + number)
        while self.take():
            request = self.one_request(chance)
            cut = chance.random() < 0.1
            status = self.exchange(request[:chance.randrange(len(request))] if cut else request, not cut)
            with self.lock:
                self.replies["cut off" if cut else status] += 1

    def take(self):
        with self.lock:
            self.sent += self.sent < self.requests
            return self.going and self.sent < self.requests

    def slow(self, number):
        """A byte every tenth of a second."""
        chance = random.Random(self.seed * 2000 + number)
        while self.going:
            try:
                with socket.create_connection((HOST, self.port), timeout=5) as s:
                    for byte in get_request(chance.choice(GETS)):
                        s.send(bytes([byte]))
                        time.sleep(0.1)
                        if not self.going:
                            return
            except OSError:
                self.replies["slow one cut off"] += 1

    def deaf(self, number):
        """Asks for a stream and never reads."""
        chance = random.Random(self.seed * 3000 + number)
        while self.going:
            try:
                with socket.create_connection((HOST, self.port), timeout=5) as s:
                    s.sendall(get_request(chance.choice(STREAMS)))
                    for _ in range(50):
                        time.sleep(0.1)
                        if not self.going:
                            return
            except OSError:
                time.sleep(0.1)

    def flood(self):
        """Two hundred connections at once that say nothing, every five seconds."""
        while self.going:
            crowd = []
            try:
                for _ in range(200):
                    s = socket.socket()
                    s.setblocking(False)
                    s.connect_ex((HOST, self.port))
                    crowd.append(s)
            except OSError:
                pass
            time.sleep(0.2)
            for s in crowd:
                s.close()
            self.replies["floods"] += 1
            time.sleep(5)

    def run(self, watch, workers=12):
        """Until all requests are sent; `watch` is called with their number about once a second."""
        threads = [threading.Thread(target=self.worker, args=(k,), daemon=True) for k in range(workers)]
        others = [threading.Thread(target=work, args=args, daemon=True) for work, args in
                  [(self.slow, (1,)), (self.slow, (2,)), (self.deaf, (1,)), (self.deaf, (2,)), (self.flood, ())]]
        for thread in threads + others:
            thread.start()
        while any(thread.is_alive() for thread in threads):
            time.sleep(1)
            watch(self.sent)
        self.going = False
        for thread in others:
            thread.join()


def answers(port, path, seconds=20):
    """Whether it is answered 200 within that time: places are taken by others for a while."""
    end = time.time() + seconds
    while time.time() < end:
        try:
            connection = http.client.HTTPConnection(HOST, port, timeout=5)
            connection.request("GET", path)
            if connection.getresponse().status == 200:
                return True
        except (OSError, http.client.HTTPException):
            pass
        time.sleep(0.2)
    return False
