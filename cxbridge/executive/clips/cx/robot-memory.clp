; Functions of the feature robot_memory: facts as documents, and trigger events.

(deftemplate robmem-trigger
  "A change of the robot memory. The fact exists for the loop of its arrival."
  (slot ptr (type EXTERNAL-ADDRESS))        ; the document of the change stream
  (slot name (type STRING))                 ; the name at the registration
  (multislot rcvd-at (type INTEGER)         ; the system time
                     (cardinality 2 2))
)

(deffunction rm-field-name (?slot)
  "Internal. The field of a document for a slot. As in Fawkes, only the first dash
   becomes an underscore."
  (bind ?dash (str-index "-" ?slot))
  (if (not ?dash) then (return (str-cat ?slot)))
  (return (str-cat (sub-string 1 (- ?dash 1) ?slot) "_"
                   (sub-string (+ ?dash 1) (str-length ?slot) ?slot)))
)

(deffunction rm-structured-fact-to-bson (?fact $?relation)
  "A document with the slots of a fact. The field `relation` is the optional ?relation,
   or else the fact's template. The caller destroys the document."
  (bind ?template (fact-relation ?fact))
  (bind ?doc (bson-create))
  (bson-append ?doc "relation" (if (= 0 (length$ ?relation))
                                then ?template else (sym-cat (nth$ 1 ?relation))))
  (progn$ (?slot (fact-slot-names ?fact))
    (bind ?value (fact-slot-value ?fact ?slot))
    (if (deftemplate-slot-multip ?template ?slot)
     then (bson-append-array ?doc (rm-field-name ?slot) ?value)
     else (bson-append ?doc (rm-field-name ?slot) ?value))
  )
  (return ?doc)
)

(deffunction rm-ordered-fact-to-bson (?fact)
  "A document with the `relation` and the `values` of an ordered fact. The caller
   destroys the document."
  (bind ?doc (bson-create))
  (bson-append ?doc "relation" (fact-relation ?fact))
  (bson-append-array ?doc "values" (fact-slot-value ?fact implied))
  (return ?doc)
)

(deffunction rm-has-slots (?relation)
  "Internal. TRUE if the relation is a template with slots. The template of ordered facts
   has the only slot `implied`."
  (return (and (member$ ?relation (get-deftemplate-list MAIN))
               (neq (create$ implied) (create$ (deftemplate-slot-names ?relation)))))
)

(deffunction rm-slot-text (?template ?doc ?field)
  "Internal. The slot of a document's field as text in a fact; empty if the template has
   no such slot."
  (bind ?slot (sym-cat ?field))
  (if (not (deftemplate-slot-existp ?template ?slot)) then (return ""))
  (if (not (deftemplate-slot-multip ?template ?slot)) then
    (return (str-cat "(" ?slot " " (bson-get ?doc ?field) ")")))
  ; as in Fawkes, the texts of a list lose their quotes, and become symbols
  (bind ?symbols (create$))
  (progn$ (?value (bson-get-array ?doc ?field))
    (bind ?symbols (create$ ?symbols (sym-cat ?value)))
  )
  (return (str-cat "(" ?slot " " (implode$ ?symbols) ")"))
)

(deffunction rm-assert-from-bson (?doc)
  "Assert and return the fact of a document. Its relation is a template, or that of
   an ordered fact. Without a relation, print an error and return FALSE."
  (if (not (bson-has-field ?doc "relation")) then
    (printout error "Can not create fact from " (bson-tostring ?doc) crlf)
    (return FALSE))
  (bind ?relation (sym-cat (bson-get ?doc "relation")))
  (bind ?text "")
  (if (rm-has-slots ?relation)
   then
    (progn$ (?field (bson-field-names ?doc))
      (bind ?text (str-cat ?text (rm-slot-text ?relation ?doc ?field)))
    )
   else
    (if (bson-has-field ?doc "values") then
      (bind ?text (implode$ (bson-get-array ?doc "values")))))
  (return (cx-assert-data (str-cat "(" ?relation " " ?text ")")))
)

(defrule rm-cleanup-trigger-facts
  "Destroy an event that no rule has handled."
  (declare (salience -4000))  ; Fawkes' salience, after the rules that handle events
  ?event <- (robmem-trigger (ptr ?doc))
  =>
  (bson-destroy ?doc)
  (retract ?event)
)
