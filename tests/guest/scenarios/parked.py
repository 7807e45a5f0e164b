#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A foreign LSS slave (Python) that continues to answer fastscan in LSS configuration state, on a line that assigns
node-IDs: the other device boots in bounded time, the slave gets its node-ID, and a scan by the console ends."""

import os

from actors import PATIENCE, Actor, Site, Witness, check, eventually, play, run
from python_lss_slave import UNCONFIGURED, PythonLssSlave

EDS = os.path.abspath(os.path.join(os.path.dirname(__file__), "../../../bridges/sim/eds"))
SLAVE, OTHER = 12, 20
VENDOR, PRODUCT, REVISION, SERIAL = 0x61, 0x62, 0x10001, 0x4711
EDS_OF_SLAVE = f"""\
[FileInfo]
FileName=parked.eds
FileVersion=1
FileRevision=0
EDSVersion=4.0
[DeviceInfo]
VendorName=A stranger
VendorNumber={VENDOR}
ProductName=Parked
ProductNumber={PRODUCT}
RevisionNumber={REVISION}
LSS_Supported=1
Granularity=0
NrOfRXPDO=0
NrOfTXPDO=0
[MandatoryObjects]
SupportedObjects=3
1=0x1000
2=0x1001
3=0x1018
[1000]
ParameterName=Device type
ObjectType=7
DataType=7
AccessType=ro
DefaultValue=0x191
[1001]
ParameterName=Error register
ObjectType=7
DataType=5
AccessType=ro
DefaultValue=0
[1018]
ParameterName=Identity
ObjectType=9
SubNumber=5
""" + "".join(
    f"[1018sub{sub}]\nParameterName=Identity {sub}\nObjectType=7\nDataType={5 if sub == 0 else 7}\nAccessType=ro\n"
    f"DefaultValue={value}\n"
    for sub, value in enumerate((4, VENDOR, PRODUCT, REVISION, SERIAL))
)
PLANT = f"""\
schema: 1
gateway: {{name: guest}}
lines:
  - name: hall
    interface: socketcan:vcan0
    bit_rate: 500kbit
    access: all
    lss: {{assign: true, period: 1s}}
    nodes:
      - {{id: {SLAVE}, name: parked, eds: EDS_OF_SLAVE, mandatory: false}}
      - {{id: {OTHER}, name: gate, eds: {EDS}/encoder.eds, heartbeat: 2s}}
"""


class Hall(Site):
    def __init__(self):
        super().__init__()
        self.bus = Witness("vcan0")
        path = os.path.join(os.environ["TMPDIR"], "parked.eds")
        with open(path, "w", encoding="ascii") as file:
            file.write(EDS_OF_SLAVE)
        self.slave = PythonLssSlave("vcan0", (VENDOR, PRODUCT, REVISION, SERIAL))
        Actor("devices", self.programs.linegate, "simulate", "socketcan:vcan0", "--device", f"encoder:{OTHER}")
        eventually("the other device is there", lambda: self.bus.boot_ups(OTHER) > 0)
        self.linegated = self.gateway("hall", PLANT.replace("EDS_OF_SLAVE", path))

    def operational(self, node):
        return any(one["node"] == node and one["state"] == "operational" for one in self.command("nodes", "hall"))


def scenario():
    hall = Hall()
    eventually("the other device is operational", lambda: hall.operational(OTHER))
    eventually("the slave has its node-ID", lambda: hall.slave.node == SLAVE)
    eventually("and is operational", lambda: hall.operational(SLAVE))
    hall.slave.kill()
    late = PythonLssSlave("vcan0", (VENDOR, PRODUCT, REVISION, SERIAL + 1))
    status, text = run(*hall.console("lss", "hall", "scan"), within=2 * PATIENCE)
    check(f"a scan by the console ends: {status}, {text}", status in (0, 1))
    check("it gave nobody a node-ID", late.node == UNCONFIGURED)
    check("the gateway ends well", hall.linegated.stop() == 0)


play(scenario)
