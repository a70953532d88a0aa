; Conversion between facts of any template and world model facts, for example to
; share goals with other robots.
;
; The wm-fact gets the key `template fact TEMPLATE args? SLOT VALUE ...` from the
; slots that identify the fact, and the other slots as its list of values. A slot is
; written as NAME VALUE, a multislot as NAME [ TYPE VALUE TYPE VALUE ... ].
;
; Needs worldmodel.clp. Functions that are not internal have Fawkes' names.

; *** Fields ***

(deffunction value-to-type-pair (?value)
  "The type of a value, and the value as a symbol."
  (return (create$ (type ?value) (sym-cat ?value)))
)

(deffunction values-to-type-pairs (?list)
  "The types and values of all elements, in turn."
  (bind ?pairs (create$))
  (progn$ (?value ?list) (bind ?pairs (create$ ?pairs (value-to-type-pair ?value))))
  (return ?pairs)
)

(deffunction type-cast (?value ?type)
  "The value as INTEGER, FLOAT, STRING or SYMBOL. For another ?type print a message, and
   return the value unchanged."
  (if (eq ?type (type ?value)) then (return ?value))
  (if (and (lexemep ?value) (or (eq ?type INTEGER) (eq ?type FLOAT))) then
    (bind ?value (string-to-field ?value)))
  (switch ?type
    (case SYMBOL then (return (sym-cat ?value)))
    (case STRING then (return (str-cat ?value)))
    (case INTEGER then (return (integer ?value)))
    (case FLOAT then (return (float ?value)))
  )
  ; Fawkes' text, with "cast" instead of the function's name
  (printout t "cast: unsupported type cast: " ?type
              " Expected INTEGER|STRING|FLOAT|SYMBOL" crlf)
  (return ?value)
)

(deffunction template-field-text (?value ?type)
  "Internal. A value, cast to ?type, as text in a fact."
  (bind ?value (type-cast ?value ?type))
  (if (and (symbolp ?value) (neq ?value (string-to-field ?value)))
   ; a symbol that CLIPS would read as another type, such as a number
   then (return (str-cat "(sym-cat " (implode$ (create$ (str-cat ?value))) ")"))
   else (return (implode$ (create$ ?value))))
)

; *** Template facts to world model facts ***

(deffunction deftemplate-remaining-slots (?template ?slots)
  "The slots of a template without ?slots (one name or several)."
  (bind ?remaining (create$))
  (progn$ (?slot (deftemplate-slot-names ?template))
    (if (not (member$ ?slot (create$ ?slots))) then
      (bind ?remaining (create$ ?remaining ?slot)))
  )
  (return ?remaining)
)

(deffunction slots-to-multifield (?fact ?slots)
  "The names and values of ?slots of a fact, in the form that the header describes. Omits, with a
   message, slots with several permitted types, because these could not be read again."
  (bind ?template (fact-relation ?fact))
  (bind ?fields (create$))
  (progn$ (?slot ?slots)
    (bind ?value (fact-slot-value ?fact ?slot))
    (if (deftemplate-slot-multip ?template ?slot)
     then
      (bind ?fields (create$ ?fields ?slot [ (values-to-type-pairs ?value) ]))
     else
      (if (= 1 (length$ (deftemplate-slot-types ?template ?slot)))
       then (bind ?fields (create$ ?fields ?slot ?value))
       else (printout t "slots-to-multifield: type of slot " ?slot " of template "
                        ?template " cannot be determined, skipping." crlf))
    )
  )
  (return ?fields)
)

(deffunction template-fact-slots-to-key-vals (?fact ?arg-slots)
  "As slots-to-multifield; ?arg-slots may also be a single name."
  (return (slots-to-multifield ?fact (create$ ?arg-slots)))
)

(deffunction assert-template-wm-fact (?fact ?id-slots ?other-slots)
  "Assert and return the wm-fact of a fact, with ?id-slots in its key and
   ?other-slots as its values."
  (return (assert
    (wm-fact (type SYMBOL) (is-list TRUE)
             (key template fact (fact-relation ?fact) args?
                  (template-fact-slots-to-key-vals ?fact ?id-slots))
             (values (template-fact-slots-to-key-vals ?fact ?other-slots)))))
)

; *** World model facts to template facts ***

(deffunction template-fact-str-from-wm (?key ?values)
  "The text of the template fact that a wm-fact encodes, for assert-string. Prints a
   message and returns an empty text if the key is not that of a template fact."
  (if (not (wm-key-prefix ?key template fact)) then
    ; Fawkes' text, with a longer name than the function's
    (printout t "template-fact-str-from-wm-key: supplied wm-fact key " ?key
                " does not encode a template fact, abort." crlf)
    (return ""))
  (bind ?template (nth$ 3 ?key))
  (bind ?args (wm-key-args ?key))
  ; As in Fawkes, the slots may follow the template, element 3 of the key, without args?. The list then
  ; begins with the template in the place of args?, because rest$ below drops the first element.
  (if (eq ?args (create$)) then (bind ?args (subseq$ ?key 3 (length$ ?key))))
  (bind ?fields (create$ (rest$ ?args) ?values))
  (bind ?text (str-cat "(" ?template))
  (bind ?idx 1)
  (while (<= ?idx (length$ ?fields)) do
    (bind ?slot (nth$ ?idx ?fields))
    (bind ?text (str-cat ?text " (" ?slot))
    (bind ?idx (+ ?idx 1))
    (if (deftemplate-slot-multip ?template ?slot)
     then
      ; after the opening bracket: types and values in turn
      (bind ?idx (+ ?idx 1))
      (while (and (< ?idx (length$ ?fields)) (neq ] (nth$ ?idx ?fields))) do
        (bind ?text (str-cat ?text " " (template-field-text (nth$ (+ ?idx 1) ?fields)
                                                            (nth$ ?idx ?fields))))
        (bind ?idx (+ ?idx 2))
      )
     else
      (bind ?type (nth$ 1 (deftemplate-slot-types ?template ?slot)))
      (bind ?text (str-cat ?text " " (template-field-text (nth$ ?idx ?fields) ?type)))
    )
    (bind ?text (str-cat ?text ")"))
    (bind ?idx (+ ?idx 1))
  )
  (return (str-cat ?text ")"))
)
