; World model facts, named by an ID and by a key.
;
; The ID is a text like a URL, for storage and exchange:
;   /domain/fact/holding?robot=R-1&objects=cup,plate
; The key has the parts of the same name, for patterns in rules:
;   (domain fact holding args? robot R-1 objects [ cup plate ])
;
; A rule asserts a wm-fact with an ID or with a key; the rules of this file add the
; other name before rules with a lower salience fire for the fact. The names of an existing fact must
; not be modified: retract the fact and assert a new one.
;
; Needs saliences.clp. All functions and rules have Fawkes' names, except the internal ones and those
; with "odd-id" and "conflict-erase", which are ours.

(deftemplate wm-fact
  "A fact of the world model."
  ; --- the names: each follows from the other
  (slot id (type STRING))
  (multislot key (type SYMBOL))
  ; --- the type of the value; nothing here converts the value or compares it with the type
  (slot type (type SYMBOL)
             (allowed-values UNKNOWN FLOAT UINT INT BOOL STRING SYMBOL))
  ; --- the value: `values` if is-list is TRUE, else `value`
  (slot is-list (type SYMBOL)
                (allowed-values FALSE TRUE))
  (slot value)
  (multislot values)
)

(deftemplate wm-fact-odd-id
  "Internal. A wm-fact whose ID differs from the ID of its key, for example without
   the leading slash. For all other facts, equal keys mean equal IDs, so that a
   conflict is found by a join on the ID."
  (slot id (type STRING))
  (slot canonical-id (type STRING))
)

; *** IDs to keys ***

(deffunction wm-split-string-sym (?str ?sep)
  "The non-empty parts of ?str between the separators ?sep (one character), as symbols."
  (bind ?parts (create$))
  (bind ?rest ?str)
  (bind ?at (str-index ?sep ?rest))
  (while ?at do
    (if (> ?at 1) then
      (bind ?parts (create$ ?parts (sym-cat (sub-string 1 (- ?at 1) ?rest)))))
    (bind ?rest (sub-string (+ ?at 1) (str-length ?rest) ?rest))
    (bind ?at (str-index ?sep ?rest))
  )
  (if (neq ?rest "") then (bind ?parts (create$ ?parts (sym-cat ?rest))))
  (return ?parts)
)

(deffunction wm-id-param-to-key (?param)
  "Internal. The key elements for a `name=value` of an ID. For a text of another form, a
   warning and the elements INVALID ?param."
  (bind ?sides (wm-split-string-sym ?param "="))
  (switch (length$ ?sides)
    (case 1 then (return (create$ ?sides [ ])))  ; no value: an empty list
    (case 2 then
      (bind ?value (nth$ 2 ?sides))
      (if (str-index "," ?value)
       then (return (create$ (nth$ 1 ?sides) [ (wm-split-string-sym ?value ",") ]))
       else (return ?sides)))
    (default
      (printout warn "Param '" ?param "' not of format name=value, ignoring" crlf)
      (return (create$ INVALID ?param)))
  )
)

(deffunction wm-id-to-key (?id)
  "The key for the ID ?id. Each element is a symbol, even a number."
  (bind ?mark (str-index "?" ?id))
  (if (not ?mark) then (return (wm-split-string-sym ?id "/")))
  (bind ?key (create$ (wm-split-string-sym (sub-string 1 (- ?mark 1) ?id) "/") args?))
  (bind ?params (sub-string (+ ?mark 1) (str-length ?id) ?id))
  (progn$ (?param (wm-split-string-sym ?params "&"))
    (bind ?key (create$ ?key (wm-id-param-to-key ?param)))
  )
  (return ?key)
)

; *** Arguments of keys ***
; The value of an argument follows its name; a list is written as name [ element ... ].

(deffunction wm-key-arg-is-multifield (?key ?name-idx)
  "TRUE if the value of the argument at ?name-idx is a list in brackets."
  (return (and (< ?name-idx (length$ ?key)) (eq [ (nth$ (+ ?name-idx 1) ?key))))
)

(deffunction wm-key-multifield-arg-end (?key ?name-idx)
  "The index of the closing bracket of the list of the argument at ?name-idx; without a
   closing bracket, the index of the key's last element."
  (bind ?length (length$ ?key))
  (loop-for-count (?i (+ ?name-idx 2) ?length) do
    (if (eq ] (nth$ ?i ?key)) then (return ?i))
  )
  ; the list begins at the end of the key: its first element would follow
  (return (max ?length (+ ?name-idx 2)))
)

(deffunction wm-key-arg-idx (?key ?arg)
  "The index of the argument named ?arg; FALSE if the key has no such argument.
   Example: (wm-key-arg-idx (create$ wm foo args? bar x) bar) -> 4"
  (bind ?mark (member$ args? ?key))
  (if (not ?mark) then (return FALSE))
  (bind ?name-idx (+ ?mark 1))
  (while (< ?name-idx (length$ ?key)) do
    (if (eq ?arg (nth$ ?name-idx ?key)) then (return ?name-idx))
    (if (wm-key-arg-is-multifield ?key ?name-idx)
     then (bind ?name-idx (+ (wm-key-multifield-arg-end ?key ?name-idx) 1))
     else (bind ?name-idx (+ ?name-idx 2)))
  )
  (return FALSE)
)

(deffunction wm-key-arg (?key ?arg)
  "The value of the argument named ?arg: a field, or a multifield for a list; nil
   if the key has no such argument."
  (bind ?name-idx (wm-key-arg-idx ?key ?arg))
  (if (not ?name-idx) then (return nil))
  (if (not (wm-key-arg-is-multifield ?key ?name-idx)) then (return (nth$ (+ ?name-idx 1) ?key)))
  (return (subseq$ ?key (+ ?name-idx 2) (- (wm-key-multifield-arg-end ?key ?name-idx) 1)))
)

(deffunction wm-key-prefix (?key $?prefix)
  "TRUE if ?key starts with the elements of ?prefix.
   Example: (wm-key-prefix (create$ domain fact foo args? bar x) domain fact)"
  (bind ?n (length$ ?prefix))
  (return (and (<= ?n (length$ ?key))
               (or (= ?n 0) (eq ?prefix (subseq$ ?key 1 ?n)))))
)

(deffunction wm-key-path ($?key)
  "The elements of the key before args?; all elements of a key without arguments."
  (bind ?mark (member$ args? ?key))
  (if ?mark then (return (subseq$ ?key 1 (- ?mark 1))))
  (return ?key)
)

(deffunction wm-key-args ($?key)
  "The elements of the key from args? on; empty for a key without arguments."
  (bind ?mark (member$ args? ?key))
  (if ?mark then (return (subseq$ ?key ?mark (length$ ?key))))
  (return (create$))
)

; *** Keys to IDs ***

(deffunction wm-key-list-to-text (?key ?first ?last)
  "Internal. The elements ?first to ?last of the key, separated by commas."
  (if (> ?first ?last) then (return ""))
  (bind ?text (nth$ ?first ?key))
  (loop-for-count (?i (+ ?first 1) ?last) do
    (bind ?text (str-cat ?text "," (nth$ ?i ?key)))
  )
  (return ?text)
)

(deffunction wm-key-spell-id (?key ?report)
  "Internal. The ID for ?key. Omits a name without a value at the end, with a warning
   if ?report is TRUE."
  (bind ?mark (member$ args? ?key))
  (bind ?length (length$ ?key))
  (bind ?id "")
  (loop-for-count (?i 1 (if ?mark then (- ?mark 1) else ?length)) do
    (bind ?id (str-cat ?id "/" (nth$ ?i ?key)))
  )
  (if (not ?mark) then (return ?id))
  (bind ?id (str-cat ?id "?"))
  (bind ?name-idx (+ ?mark 1))
  (while (< ?name-idx ?length) do
    (bind ?value-end (+ ?name-idx 1))
    (bind ?value (nth$ ?value-end ?key))
    ; as in Fawkes, an opening bracket at the end of the key is a plain value
    (if (and (eq ?value [) (< ?value-end ?length)) then
      (bind ?value-end (wm-key-multifield-arg-end ?key ?name-idx))
      (bind ?value (wm-key-list-to-text ?key (+ ?name-idx 2) (- ?value-end 1))))
    (bind ?id (str-cat ?id (nth$ ?name-idx ?key) "=" ?value
                       (if (< (+ ?value-end 1) ?length) then "&" else "")))
    (bind ?name-idx (+ ?value-end 1))
  )
  ; an element is left, to which no value belongs
  (if (and ?report (= ?name-idx ?length)) then
    (printout warn "Missing value for argument " (nth$ ?name-idx ?key) " in " ?key crlf))
  (return ?id)
)

(deffunction wm-key-to-id ($?key)
  "The ID for the key. Not always the inverse of wm-id-to-key: a list of one element
   becomes a plain value, and an unclosed list loses its last element."
  (return (wm-key-spell-id ?key TRUE))
)

; *** Rules ***

(defrule wm-fact-id2key
  "A new fact has an ID and no key."
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  ?wf <- (wm-fact (id ?id&~"") (key))
  =>
  (modify ?wf (key (wm-id-to-key ?id)))
)

(defrule wm-fact-key2id
  "A new fact has a key and no ID."
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  ?wf <- (wm-fact (id "") (key ?first $?rest))
  =>
  (modify ?wf (id (wm-key-to-id ?first ?rest)))
)

(defrule wm-fact-note-odd-id
  "Mark the facts whose ID is not the ID of their key. Facts without a key have not got it yet."
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (logical (wm-fact (id ?id&~"")
                    (key $?key&:(neq ?id (wm-key-spell-id ?key FALSE)))))
  (test (neq ?key (create$)))
  =>
  (assert (wm-fact-odd-id (id ?id) (canonical-id (wm-key-spell-id ?key FALSE))))
)

(deffunction wm-key-conflict-erase (?kept ?erased ?key)
  "Internal. Report two facts with the same key, and retract the older, ?erased."
  (printout error "Two world model facts with the same key '" ?key "': "
                  ?kept " (" (fact-slot-value ?kept id) ") and "
                  ?erased " (" (fact-slot-value ?erased id) ")" crlf)
  (progn$ (?wf (create$ ?kept ?erased))
    (printout error "Fact " ?wf ":" crlf)
    (ppfact ?wf error TRUE)
  )
  (printout error "Erasing " ?erased crlf)
  (retract ?erased)
)

; The joins are on the ID, because CLIPS looks up single fields in a hash table, but
; compares multifields such as the key for each fact.

(defrule wm-key-conflict
  "Two facts with the same key and the same ID."
  (declare (salience ?*SALIENCE-HIGH*))
  ?newer <- (wm-fact (id ?id) (key $?key))
  ?older <- (wm-fact (id ?id) (key $?key))
  (test (> (fact-index ?newer) (fact-index ?older)))
  =>
  (wm-key-conflict-erase ?newer ?older ?key)
)

(deffunction wm-key-conflict-erase-older (?one ?other ?key)
  "Internal. As wm-key-conflict-erase, for two facts in any order."
  (if (> (fact-index ?one) (fact-index ?other))
   then (wm-key-conflict-erase ?one ?other ?key)
   else (wm-key-conflict-erase ?other ?one ?key))
)

(defrule wm-key-conflict-odd-id
  "Two facts with the same key, of which one has another spelling of the ID."
  (declare (salience ?*SALIENCE-HIGH*))
  (wm-fact-odd-id (id ?odd) (canonical-id ?id))
  ?canonical <- (wm-fact (id ?id&~?odd) (key $?key))
  ?odd-fact <- (wm-fact (id ?odd) (key $?key))
  =>
  (wm-key-conflict-erase-older ?canonical ?odd-fact ?key)
)

(defrule wm-key-conflict-odd-ids
  "Two facts with the same key, of which both have another spelling of the ID."
  (declare (salience ?*SALIENCE-HIGH*))
  (wm-fact-odd-id (id ?odd1) (canonical-id ?id))
  (wm-fact-odd-id (id ?odd2&~?odd1) (canonical-id ?id))
  ?one <- (wm-fact (id ?odd1) (key $?key))
  ?other <- (wm-fact (id ?odd2) (key $?key))
  =>
  (wm-key-conflict-erase-older ?one ?other ?key)
)
