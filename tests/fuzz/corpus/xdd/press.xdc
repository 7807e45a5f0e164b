<?xml version="1.0" encoding="utf-8"?>
<ISO15745ProfileContainer xmlns="http://www.canopen.org/xml/1.1" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance">
<ISO15745Profile><ProfileBody xsi:type="ProfileBody_Device_CANopen" fileName="axis.xdd" fileVersion="1.0" fileCreator="somebody" fileCreationDate="2026-01-15">
<DeviceIdentity>
<vendorName>Linegate</vendorName>
<vendorID>0x0000AFFE</vendorID>
<productName> Axis </productName>
<productID>16</productID>
</DeviceIdentity>
<ApplicationProcess><parameterList></parameterList></ApplicationProcess>
</ProfileBody></ISO15745Profile>
<ISO15745Profile><ProfileBody xsi:type="ProfileBody_CommunicationNetwork_CANopen">
<ApplicationLayers><CANopenObjectList>
<CANopenObject index="1017" name="Heartbeat" objectType="7" dataType="0006" accessType="rw" defaultValue="0" actualValue="500" denotation="Pulse"/>
</CANopenObjectList>
<dummyUsage><dummy entry="Dummy0001=0"/><dummy entry="Dummy0002=0"/><dummy entry="Dummy0003=0"/><dummy entry="Dummy0004=0"/><dummy entry="Dummy0005=1"/><dummy entry="Dummy0006=1"/><dummy entry="Dummy0007=0"/></dummyUsage>
<dynamicChannels><dynamicChannel dataType="0007" accessType="readWriteOutput" startIndex="A480" endIndex="A4BF" maxNumber="4" addressOffset="16"/></dynamicChannels>
</ApplicationLayers>
<TransportLayers><PhysicalLayer><baudRate defaultValue="250 Kbps"><supportedBaudRate value="125 Kbps"/><supportedBaudRate value="250 Kbps"/></baudRate></PhysicalLayer></TransportLayers>
<NetworkManagement><CANopenGeneralFeatures granularity="8" nrOfRxPDO="1" nrOfTxPDO="2" bootUpSlave="true" layerSettingServiceSlave="true"/><CANopenMasterFeatures bootUpMaster="false"/><deviceCommissioning nodeID="9" nodeName="Press" actualBaudRate="500 Kbps" networkNumber="3" networkName="Hall" CANopenManager="false"/></NetworkManagement>
</ProfileBody></ISO15745Profile>
</ISO15745ProfileContainer>
