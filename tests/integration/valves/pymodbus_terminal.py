"""A valve terminal by pymodbus (3.0, Debian 12): one word a valve is written, three are read: actual, set point, diagnosis.

usage: pymodbus_terminal.py VALVES WRITE READ TIMEOUT [REFUSE_TIMEOUT]
Prints "port N", then serves on 127.0.0.1. Valves follow at once; outputs reset when nothing was written for the time in
the TIMEOUT register (ms). A line "diagnosis V BITS" on standard input sets valve V's diagnosis; "state" prints one line:
the largest set point now, the largest ever, how many writes were negative, the time-out in ms.
"""
import asyncio
import sys
import time

from pymodbus.datastore import ModbusServerContext, ModbusSlaveContext, ModbusSparseDataBlock
from pymodbus.server import StartAsyncTcpServer

VALVES, WRITE, READ, TIMEOUT = (int(a) for a in sys.argv[1:5])
REFUSE_TIMEOUT = len(sys.argv) > 5


class Registers(ModbusSparseDataBlock):
    """Holding registers behind which valves follow at once."""

    def __init__(self):
        places = [*range(WRITE, WRITE + VALVES), *range(READ, READ + 3 * VALVES), TIMEOUT]
        super().__init__({place: 0 for place in places})
        self.last_write_s = time.monotonic()
        self.largest = self.negative = 0

    def setValues(self, address, values, use_as_default=False):
        self.last_write_s = time.monotonic()
        if address == TIMEOUT and REFUSE_TIMEOUT:
            return
        super().setValues(address, values)
        if WRITE <= address < WRITE + VALVES:
            self.negative += sum(v > 32767 for v in values)
            self.largest = max(self.largest, *values)
            self.follow()

    def set_points(self):
        return [self.values[WRITE + v] for v in range(VALVES)]

    def follow(self):
        for valve, value in enumerate(self.set_points()):
            self.values[READ + 3 * valve] = self.values[READ + 3 * valve + 1] = value

    def expire(self):
        timeout_ms = self.values[TIMEOUT]
        if timeout_ms > 0 and 1e3 * (time.monotonic() - self.last_write_s) > timeout_ms:
            for valve in range(VALVES):
                self.values[WRITE + valve] = 0
            self.follow()


async def obey(registers):
    reader = asyncio.StreamReader()
    await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    while line := (await reader.readline()).split():
        if line[0] == b"diagnosis":
            registers.values[READ + 3 * int(line[1]) + 2] = int(line[2])
        elif line[0] == b"state":
            registers.expire()
            print("state", max(registers.set_points()), registers.largest, registers.negative,
                  registers.values[TIMEOUT], flush=True)


async def main():
    registers = Registers()
    context = ModbusServerContext(ModbusSlaveContext(hr=registers, zero_mode=True), single=True)
    server = await StartAsyncTcpServer(context, address=("127.0.0.1", 0), defer_start=True)
    task = asyncio.ensure_future(server.serve_forever())
    while server.server is None:
        await asyncio.sleep(0.01)
    print("port", server.server.sockets[0].getsockname()[1], flush=True)
    await obey(registers)
    task.cancel()


asyncio.run(main())
