"""A Modbus client by pymodbus (3.0, Debian 12) before `softarm-plant --modbus`: usage pymodbus_client.py PORT.
The registers are those of the preset cpx_vppm, twelve valves. Exit code 0: everything was as it should be."""
import sys
import time

from pymodbus.client import ModbusTcpClient

WRITE, READ, TIMEOUT, VALVES = 40003, 45395, 46100, 12
PATIENCE_S = 10.0

client = ModbusTcpClient("127.0.0.1", port=int(sys.argv[1]), timeout=5)
assert client.connect()


def read(address, count):
    answer = client.read_holding_registers(address, count, slave=1)
    assert not answer.isError(), answer
    return answer.registers


def write(set_points):
    assert not client.write_registers(WRITE, set_points, slave=1).isError()


def wait_for(reached, keep):
    """Polls; `keep` is written meanwhile, or nothing is asked at all for longer than the time-out."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if keep is not None:
            write(keep)
        if reached(read(READ, 3 * VALVES)):
            return True
        time.sleep(0.02 if keep is not None else 0.5)
    return False


assert not client.write_register(TIMEOUT, 200, slave=1).isError()
assert read(TIMEOUT, 1) == [200]
wanted = [100 * (v % 4) for v in range(VALVES)]
assert wait_for(lambda r: all(abs(r[3 * v] - wanted[v]) <= 2 for v in range(VALVES)), wanted), "pressures do not follow"
assert read(READ, 3 * VALVES)[1::3] == wanted, "set points read back differ"
assert wait_for(lambda r: max(r[0::3]) <= 2, None), "it does not vent without writes"
assert read(WRITE, VALVES) == [0] * VALVES, "its time-out leaves set points"
assert client.write_registers(READ, [1], slave=1).isError(), "measured pressures can be written"
assert client.read_holding_registers(100, 1, slave=1).isError(), "registers that are not there can be read"
assert client.read_coils(0, 1, slave=1).isError(), "it has coils"
print("as it should be")
